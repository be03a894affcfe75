import { useSignal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { KIND_NAMES, LAMP_KINDS, type LampKind } from '../state/lamp_make';
import { useApp } from './context';
import { Icon } from './Icon';

const SAYS: Record<LampKind, string> = {
    point: 'a point, in all directions',
    spot: 'a point, into a cone',
    quad: 'a rectangle, from one side',
    disc: 'a disc, from one side',
    sphere: 'a ball, in all directions',
    directional: 'from far away, parallel',
};

/** A button that opens the kinds of lamps. Escape closes them, and so does leaving. */
export function AddLamp() {
    const app = useApp();
    const open = useSignal(false);
    const root = useRef<HTMLDivElement>(null);
    useLayoutEffect(() => {
        if (open.value) root.current?.querySelector<HTMLElement>('.menu button')?.focus();
    }, [open.value]);
    const close = (): void => {
        open.value = false;
        root.current?.querySelector<HTMLElement>('button')?.focus();
    };
    const onKeyDown = (e: KeyboardEvent): void => {
        const items = [...root.current!.querySelectorAll<HTMLElement>('.menu button')];
        const at = items.indexOf(e.target as HTMLElement);
        const step: Record<string, number> = { ArrowDown: 1, ArrowUp: -1 };
        if (!open.value) return;
        if (e.key === 'Escape') close();
        else if (e.key in step) items[(at + step[e.key]! + items.length) % items.length]?.focus();
        else return;
        e.preventDefault();
        e.stopPropagation();
    };
    const leave = (e: FocusEvent): void => {
        if (!root.current?.contains(e.relatedTarget as Node | null)) open.value = false;
    };
    const add = (kind: LampKind): void => {
        close();
        void app.lamps.add(kind);
    };
    const where = app.lux.reading.value ? 'on the picked point' : 'in front of the camera, under the ceiling if there is one';
    return (
        <div ref={root} class="add-lamp" onKeyDown={onKeyDown} onFocusOut={leave}>
            <button
                type="button"
                class="button with-icon"
                aria-haspopup="menu"
                aria-expanded={open.value}
                title="Add a lamp"
                onClick={() => (open.value = !open.value)}
            >
                <Icon name="plus" />
                Add
            </button>
            {open.value && (
                <div class="menu">
                    <div role="menu" aria-label={`Add a lamp ${where}`}>
                        {KIND_NAMES.map((kind) => (
                            <button key={kind} type="button" role="menuitem" tabIndex={-1} onClick={() => add(kind)}>
                                {LAMP_KINDS[kind]} <small>{SAYS[kind]}</small>
                            </button>
                        ))}
                    </div>
                    <p aria-hidden="true">{where}</p>
                </div>
            )}
        </div>
    );
}
