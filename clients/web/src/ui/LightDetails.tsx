import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { number } from '../lib/format';
import { numberOr, type SceneRecord } from '../protocol/types';
import { aimed, aimOf, anglesOf, canPointAt, directionOf, isAimed, type Angles } from '../state/lamp_make';
import { asInModel, emitsOf, isAdjusted, isPlaced, kindOf } from '../state/lights';
import { anchorOf } from '../state/placement';
import { ArrayForm } from './ArrayForm';
import { ColourFields } from './ColourFields';
import { useApp } from './context';
import { DimFields } from './DimFields';
import { GroupField } from './GroupField';
import { LuminaireFacts } from './LuminaireFacts';
import { NumberField } from './NumberField';
import { VectorFields } from './VectorFields';

export function LightDetails({ light, onShown }: { light: SceneRecord; onShown(): void }) {
    const app = useApp();
    useEffect(onShown, []);
    return (
        <div class="light-details">
            <p class="kind">{kindOf(light)} light</p>
            <DimFields lights={[light]} />
            <ColourFields lights={[light]} />
            {emitsOf(light) ? <Surface light={light} /> : isPlaced(light) && <Position light={light} />}
            {isAimed(light) && <Aim light={light} />}
            {light.kind === 'ies' && <LuminaireFacts light={light} />}
            <GroupField name={light.id} lights={[light]} onCommit={(group) => app.lamps.setGroup(light.id, group)} />
            <Actions light={light} />
        </div>
    );
}

/** What follows from the shape of an object that shines, and the way back to its material's light. */
function Surface({ light }: { light: SceneRecord }) {
    const app = useApp();
    const emits = emitsOf(light)!;
    return (
        <p class="kind surface">
            {number(numberOr(emits.luminance_cd_m2, 0))} <small>cd/m²</small> over {number(numberOr(emits.area_m2, 0))} <small>m²</small>
            {emits.sides === 'both' ? ', both sides' : ', one side'}
            {isAdjusted(light) && (
                <button type="button" class="button" onClick={() => void app.edits.transaction([asInModel(light.id)])}>
                    As in the model
                </button>
            )}
        </p>
    );
}

function Position({ light }: { light: SceneRecord }) {
    const app = useApp();
    return (
        <VectorFields
            label={`${light.id} position in metres`}
            names={['X', 'Y', 'Z']}
            value={anchorOf(light)}
            unit="m"
            limits={[-1e9, 1e9]}
            step={app.snap.gridM.value}
            onCommit={(position) => app.edits.setOnce(light.id, '/position', [...position])}
        />
    );
}

/** Where its light goes: as angles, or by picking what it points at. */
function Aim({ light }: { light: SceneRecord }) {
    const app = useApp();
    const { tilt, turn } = anglesOf(aimOf(light));
    const aiming = app.lamps.aiming.value === light.id;
    const set = (angles: Angles): void => {
        const op = aimed(light, directionOf(angles));
        if (op.op === 'set') app.edits.setOnce(op.id, op.path, op.value);
    };
    return (
        <div class="fields is-aim" role="group" aria-label={`${light.id} aim`}>
            <NumberField label="Tilt" value={round(tilt)} unit="°" min={0} max={180} step={app.snap.angleDeg.value} onCommit={(v) => set({ tilt: v, turn })} />
            <NumberField label="Turn" value={round(turn)} unit="°" min={-360} max={360} step={app.snap.angleDeg.value} onCommit={(v) => set({ tilt, turn: v })} />
            {canPointAt(light) && (
                <button
                    type="button"
                    class="toggle"
                    aria-pressed={aiming}
                    title="Then click in the picture what it is to point at (A)"
                    onClick={() => (app.lamps.aiming.value = aiming ? null : light.id)}
                >
                    Point at…
                </button>
            )}
        </div>
    );
}

const round = (degrees: number): number => Number(degrees.toFixed(1)) + 0;

function Actions({ light }: { light: SceneRecord }) {
    const app = useApp();
    const rows = useSignal(false);
    return (
        <>
            <div class="actions">
                <button type="button" class="button" title="Ctrl + D" onClick={() => void app.lamps.duplicate(light.id)}>
                    Copy
                </button>
                {light.type === 'light' && isPlaced(light) && (light.kind !== 'ies' || light.asset) && (
                    <button type="button" class="button" aria-expanded={rows.value} title="Copies of it in columns and rows" onClick={() => (rows.value = !rows.value)}>
                        Rows…
                    </button>
                )}
                <button type="button" class="button" title="Delete" aria-label={`Remove ${light.id}`} onClick={() => void app.lamps.remove(light.id)}>
                    Remove
                </button>
            </div>
            {rows.value && <ArrayForm light={light} onDone={() => (rows.value = false)} />}
        </>
    );
}
