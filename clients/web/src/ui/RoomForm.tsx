import { useSignal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { ROOM_LIMITS, USUAL_ROOM, type Room } from '../state/room_make';
import { useApp } from './context';
import { NumberField } from './NumberField';
import { goTo } from './SectionNav';

/** An empty room, for who has no model of one. */
export function RoomForm() {
    const { imports } = useApp();
    const room = useSignal<Room>(USUAL_ROOM);
    const busy = useSignal(false);
    const form = useRef<HTMLDivElement>(null);
    useLayoutEffect(() => {
        form.current?.scrollIntoView({ block: 'nearest' });
        form.current?.querySelector('input')?.focus();
    }, []);
    const build = async (): Promise<void> => {
        if (busy.value) return;
        busy.value = true;
        const built = await imports.build(room.value);
        busy.value = false;
        if (built) goTo('library-title'); // what a room needs next
    };
    const { side, height, reflectance } = ROOM_LIMITS;
    const field = (label: string, what: keyof Room, unit: string, limits: { min: number; max: number }, step: number) => (
        <NumberField label={label} unit={unit} {...limits} step={step} value={room.value[what]} onCommit={(v) => (room.value = { ...room.value, [what]: v })} />
    );
    return (
        <div ref={form} class="array" role="group" aria-label="A new room">
            <div class="fields">
                {field('Length', 'length', 'm', side, 0.1)}
                {field('Width', 'width', 'm', side, 0.1)}
                {field('Height', 'height', 'm', height, 0.1)}
            </div>
            <p class="hint">How much of the light they reflect:</p>
            <div class="fields">
                {field('Ceiling', 'ceiling', '%', reflectance, 5)}
                {field('Walls', 'walls', '%', reflectance, 5)}
                {field('Floor', 'floor', '%', reflectance, 5)}
            </div>
            <div class="actions">
                <button type="button" class="button button-primary" disabled={busy.value} onClick={() => void build()}>
                    Build it
                </button>
            </div>
        </div>
    );
}
