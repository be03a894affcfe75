/** Where the focus goes when what has it goes away: never to the page as a whole, where the keyboard begins anew. */
import type { RefObject } from 'preact';
import { useLayoutEffect } from 'preact/hooks';

export const toStage = (): void => document.querySelector<HTMLElement>('.stage')?.focus({ preventScroll: true });

/** To the picture, or where else it belongs, when this goes while the focus is in it. */
export function useFocusAfter(box: RefObject<HTMLElement | null>, to: () => void = toStage): void {
    useLayoutEffect(() => {
        const element = box.current;
        return () => {
            if (element?.contains(document.activeElement)) to();
        };
    }, []);
}
