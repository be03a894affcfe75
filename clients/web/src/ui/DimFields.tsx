import { number } from '../lib/format';
import type { Op, SceneRecord } from '../protocol/types';
import { allAt, fromDali, fullOf, inUnit, levelOfAll, toDali, type Full } from '../state/dimming';
import { fluxOf, intensityOf } from '../state/lights';
import { common, fieldOfAll } from '../state/many';
import { useApp } from './context';
import { NumberField } from './NumberField';

const MOST = 1e12;

/** How bright one lamp is, or several: in their unit, in percent, and as DALI counts. Each takes the others' units, too. */
export function DimFields({ lights }: { lights: readonly SceneRecord[] }) {
    const app = useApp();
    const full = (light: SceneRecord): Full | null => fullOf(light, app.selection.found(light));
    const told = lights.map(intensityOf);
    const { field, unit } = told[0]!;
    const alike = told.every((t) => t.field === field);
    const level = levelOfAll(lights, full);
    const set = (ops: readonly Op[]): void => void app.edits.transaction([...ops]);
    const other = (value: number, typed: string): boolean => {
        const ops = inUnit(lights, value, typed, full);
        if (ops) set(ops);
        return ops !== null;
    };
    const most = lights.map(full);
    return (
        <div class="fields" role="group" aria-label="Brightness">
            {alike && (
                <NumberField
                    label="Intensity"
                    title="Or typed with another unit: 50 %, 800 lm, 120 cd, DALI as 200 dali"
                    value={common(told.map((t) => t.value))}
                    unit={unit.symbol}
                    min={0}
                    max={MOST}
                    onCommit={(v) => (lights.length === 1 ? app.edits.setOnce(lights[0]!.id, `/${field}`, v) : set(fieldOfAll(lights, `/${field}`, v)))}
                    onOther={other}
                />
            )}
            {most.every((f) => f !== null) && (
                <>
                    <NumberField
                        label="Dim"
                        title={`Percent of ${ofWhat(lights, most)}`}
                        value={level === null ? null : Number((100 * level).toPrecision(4))}
                        unit="%"
                        min={0}
                        max={1e6}
                        step={5}
                        onCommit={(v) => set(allAt(lights, v / 100, full))}
                        onOther={other}
                    />
                    <NumberField
                        label="DALI"
                        title="Level of IEC 62386-102: 0 off, 254 all of it, by even ratios between"
                        value={level === null ? null : toDali(level)}
                        unit=""
                        min={0}
                        max={254}
                        onCommit={(v) => set(allAt(lights, fromDali(Math.round(v)), full))}
                        onOther={other}
                    />
                </>
            )}
        </div>
    );
}

function ofWhat(lights: readonly SceneRecord[], most: readonly (Full | null)[]): string {
    const kinds = new Set(most.map((f) => f?.of));
    if (kinds.size > 1) return 'the light of their files, or of what it was when they were selected';
    if (!kinds.has('file')) return kinds.has('model') ? 'the light of the model' : 'what it was when selected';
    const lumens = lights.reduce((sum, l) => sum + (fluxOf({ ...l, flux_lm: null, multiplier: 1 }) ?? 0), 0);
    return `the ${number(lumens)} lm of the ${lights.length > 1 ? 'files' : 'file'}`;
}
