import type { ComponentChildren } from 'preact';
import { NOT_TO_EDIT } from '../state/role';
import { useApp } from './context';

/** What is in it changes the scene: whoever may not sees it, and cannot use it. */
export function Editing({ children }: { children: ComponentChildren }) {
    const may = useApp().mayEdit.value;
    return (
        <fieldset class="editing" disabled={!may} title={may ? undefined : NOT_TO_EDIT}>
            {children}
        </fieldset>
    );
}
