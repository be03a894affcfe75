import { useSignal } from '@preact/signals';
import { number } from '../lib/format';
import { scale } from '../lib/vec';
import { isObject } from '../protocol/rpc';
import { type SceneRecord } from '../protocol/types';
import { fluxOf } from '../state/lights';
import { axesOf, MOST_LAMPS, type Rows } from '../state/luminaires';
import { useApp } from './context';
import { NumberField } from './NumberField';

/** Rows of copies of a lamp: from where it is with a spacing, or evenly over the whole floor. */
export function ArrayForm({ light, onDone }: { light: SceneRecord; onDone(): void }) {
    const app = useApp();
    const columns = useSignal(4);
    const rows = useSignal(3);
    const across = useSignal(1.8);
    const along = useSignal(1.8);
    const busy = useSignal(false);
    const n = columns.value * rows.value;
    const lumens = fluxOf(light);
    const watts = isObject(light.photometry) && typeof light.photometry.watts === 'number' ? light.photometry.watts : null;
    const make = async (wanted: () => Promise<Rows | null> | Rows): Promise<void> => {
        if (busy.value) return;
        busy.value = true;
        const made = await wanted();
        if (made) await app.lamps.array(light.id, made);
        busy.value = false;
        if (made) onDone();
    };
    const bySpacing = (): Rows => {
        const axes = axesOf(light);
        return { columns: columns.value, rows: rows.value, across: scale(axes.across, across.value), along: scale(axes.along, along.value), from: null };
    };
    return (
        <div class="array" role="group" aria-label={`Rows of ${light.id}`}>
            <div class="fields">
                <NumberField label="Columns" unit="" min={1} max={Math.floor(MOST_LAMPS / rows.value)} step={1} value={columns.value} onCommit={(v) => (columns.value = Math.round(v))} />
                <NumberField label="Rows" unit="" min={1} max={Math.floor(MOST_LAMPS / columns.value)} step={1} value={rows.value} onCommit={(v) => (rows.value = Math.round(v))} />
            </div>
            <div class="fields">
                <NumberField label="Between columns" unit="m" min={-1000} max={1000} step={0.1} value={across.value} onCommit={(v) => (across.value = v)} />
                <NumberField label="Between rows" unit="m" min={-1000} max={1000} step={0.1} value={along.value} onCommit={(v) => (along.value = v)} />
            </div>
            <p class="hint">
                {n} lamps{lumens === null ? '' : `, ${number(n * lumens)} lm`}
                {watts === null ? '' : `, ${number(n * watts)} W`}
            </p>
            <div class="actions">
                <button
                    type="button"
                    class="button"
                    disabled={busy.value || n < 2}
                    title="In the middles of equal cells of the floor, at the lamp’s height"
                    onClick={() => void make(() => app.lamps.overFloor(light.id, columns.value, rows.value))}
                >
                    Spread over the floor
                </button>
                <button type="button" class="button" disabled={busy.value || n < 2} title="The lamp stays where it is" onClick={() => void make(bySpacing)}>
                    Copy with this spacing
                </button>
            </div>
        </div>
    );
}
