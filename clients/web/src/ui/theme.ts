/** Dark or high contrast; the system's wish until the user chooses. */
import { signal } from '@preact/signals';

export type Theme = 'dark' | 'contrast';
const KEY = 'lumend.theme';

function stored(): Theme | null {
    try {
        const value = localStorage.getItem(KEY);
        return value === 'dark' || value === 'contrast' ? value : null;
    } catch {
        return null;
    }
}

const current = signal<Theme>(stored() ?? (matchMedia('(prefers-contrast: more)').matches ? 'contrast' : 'dark'));

export function applyTheme(): void {
    document.documentElement.dataset.theme = current.peek();
}

export function useTheme(): { name: Theme; toggle(): void } {
    return {
        name: current.value,
        toggle: () => {
            current.value = current.value === 'dark' ? 'contrast' : 'dark';
            try {
                localStorage.setItem(KEY, current.value);
            } catch {
                // Not remembered, that is all.
            }
            applyTheme();
        },
    };
}
