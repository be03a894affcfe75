import { useEffect, useRef } from 'preact/hooks';
import type { Vec3 } from '../lib/vec';
import { stringOr, type SceneRecord } from '../protocol/types';
import { placementOf, type Placement } from '../state/placement';
import { useApp } from './context';
import { Icon } from './Icon';
import { NumberField } from './NumberField';
import { VectorFields } from './VectorFields';

/** The protocol takes up to 10⁶ either way; what is smaller than this is a slip of the hand, and 0 cannot be undone in the model. */
const SCALE: readonly [number, number] = [0.001, 1e6];

/** A model: look at it, move it as a whole, take it away. */
export function ImportRow({ id }: { id: string }) {
    const app = useApp();
    const record = app.scene.record(id);
    const selected = app.imports.selected.value === id;
    const row = useRef<HTMLLIElement>(null);
    useEffect(() => {
        if (selected) row.current?.scrollIntoView({ block: 'nearest' });
    }, [selected]);
    if (!record) return null;
    return (
        <li ref={row} class={`light model ${selected ? 'is-selected' : ''}`}>
            <div class="light-head">
                <button
                    type="button"
                    class="light-name"
                    aria-expanded={selected}
                    title={stringOr(record.asset, '')}
                    onClick={() => (app.imports.selected.value = selected ? null : id)}
                >
                    {id}
                </button>
                <button type="button" class="icon-button" aria-label={`Look at ${id}`} title="Look at it" onClick={() => void app.framing.record(id)}>
                    <Icon name="frame" />
                </button>
                <button type="button" class="icon-button" aria-label={`Remove ${id}`} title="Remove" onClick={() => app.imports.remove(id)}>
                    <Icon name="close" />
                </button>
            </div>
            {selected && <Details record={record} />}
        </li>
    );
}

function Details({ record }: { record: SceneRecord }) {
    const placement = placementOf(record);
    return (
        <div class="light-details">
            <p class="kind">{stringOr(record.asset, '')}</p>
            {placement ? <PlacementFields id={record.id} placement={placement} /> : <p class="hint">Placed by a matrix.</p>}
        </div>
    );
}

function PlacementFields({ id, placement }: { id: string; placement: Placement }) {
    const app = useApp();
    const set = (part: string, value: Vec3): void => app.edits.setOnce(id, `/transform/${part}`, [...value]);
    return (
        <>
            <VectorFields
                label={`${id} position in metres`}
                names={['X', 'Y', 'Z']}
                value={placement.translate}
                unit="m"
                limits={[-1e9, 1e9]}
                step={0.05}
                onCommit={(v) => set('translate', v)}
            />
            <VectorFields
                label={`${id} rotation in degrees`}
                names={['Turn X', 'Turn Y', 'Turn Z']}
                value={placement.rotateDeg}
                unit="°"
                limits={[-3600, 3600]}
                step={5}
                onCommit={(v) => set('rotate_deg', v)}
            />
            <ScaleFields id={id} scale={placement.scale} onCommit={(v) => set('scale', v)} />
        </>
    );
}

/** One number, unless the model is stretched already. */
function ScaleFields({ id, scale, onCommit }: { id: string; scale: Vec3; onCommit(v: Vec3): void }) {
    const uniform = scale[0] === scale[1] && scale[1] === scale[2];
    if (!uniform) {
        return (
            <VectorFields
                label={`${id} scale`}
                names={['Scale X', 'Scale Y', 'Scale Z']}
                value={scale}
                unit="×"
                limits={SCALE}
                step={0.1}
                onCommit={onCommit}
            />
        );
    }
    return (
        <div class="fields">
            <NumberField
                label="Scale"
                value={scale[0]}
                unit="×"
                min={SCALE[0]}
                max={SCALE[1]}
                step={0.1}
                onCommit={(s) => onCommit([s, s, s])}
            />
        </div>
    );
}
