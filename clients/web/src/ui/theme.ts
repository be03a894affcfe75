/** Dark or high contrast; the system's wish until the user chooses. */
import { effect, signal } from '@preact/signals';
import { recall, remember } from '../lib/store';

const KEY = 'lumend.theme';
const stored = recall('localStorage', KEY);

/** True: high contrast. */
const contrast = signal(stored ? stored === 'contrast' : matchMedia('(prefers-contrast: more)').matches);

effect(() => {
    document.documentElement.dataset.theme = contrast.value ? 'contrast' : 'dark';
});

export function useTheme(): { contrast: boolean; toggle(): void } {
    return {
        contrast: contrast.value,
        toggle: () => {
            contrast.value = !contrast.value;
            remember('localStorage', KEY, contrast.value ? 'contrast' : 'dark');
        },
    };
}
