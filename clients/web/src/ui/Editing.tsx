import type { ComponentChildren } from 'preact';
import { useApp } from './context';

/** What is in it changes the scene: whoever may not sees it, and cannot use it. */
export function Editing({ children }: { children: ComponentChildren }) {
    const app = useApp();
    const may = app.mayEdit.value;
    return (
        <fieldset class="editing" disabled={!may} title={may ? undefined : app.whyNot.value}>
            {children}
        </fieldset>
    );
}
