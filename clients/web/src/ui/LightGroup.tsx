import { useSignal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { number } from '../lib/format';
import { logScale } from '../lib/scale';
import type { SceneRecord } from '../protocol/types';
import { groupIntensity, groupStart, scaledTo, type GroupStart } from '../state/groups';
import { dimmedAsInModel, isOn, nameOf } from '../state/lights';
import { useApp } from './context';
import { dimmerSteps, LightRow, ModelButton, SoloButton } from './LightRow';
import { Slider } from './Slider';

interface Props {
    name: string;
    ids: readonly string[];
    /** Those that have a row; the others are dimmed, switched and soloed with them. */
    rows: readonly string[];
    open: boolean;
}

/** Lamps that are mixed together: dimmed, switched and soloed as one. */
export function LightGroup({ name, ids, rows, open }: Props) {
    const app = useApp();
    const toggled = useSignal<boolean | null>(null);
    const records = ids.map((id) => app.scene.record(id)).filter((r) => r !== undefined);
    const selected = app.selectedLight.value;
    const isOpen = toggled.value ?? (open || (selected !== null && ids.includes(selected)));
    const anyOn = records.some(isOn);
    const { value, model, unit, total } = groupIntensity(records);
    const label = nameOf({ ...records[0]!, id: name }).replace(/^material\//, '');
    const switchAll = (): void => {
        void app.edits.transaction(ids.map((id) => ({ op: 'set', id, path: '/on', value: !anyOn })));
    };
    return (
        <div class={`light-group ${anyOn ? '' : 'is-off'}`}>
            <div class="light-group-head">
                <button type="button" class="light-name" title={name} aria-expanded={isOpen} onClick={() => (toggled.value = !isOpen)}>
                    <span class="label">
                        {isOpen ? '▾' : '▸'} {label}
                    </span>{' '}
                    <span class="count">{ids.length}</span>
                </button>
                <span class="light-value" title={total ? 'All of the group together' : 'The brightest of the group'}>
                    {number(value)} <small>{unit.symbol}</small>
                </span>
                <ModelButton
                    name={`group ${name}`}
                    value={value}
                    model={model}
                    onClick={() => void app.edits.transaction(ids.map(dimmedAsInModel))}
                />
                <button type="button" role="switch" class="button" aria-checked={anyOn} aria-label={`Group ${name} on`} onClick={switchAll}>
                    {anyOn ? 'Off' : 'On'}
                </button>
                <SoloButton name={`group ${name}`} ids={ids} />
            </div>
            <GroupDimmer name={name} records={records} />
            {isOpen && (
                <ul class="light-list">
                    {rows.map((id) => (
                        <LightRow key={id} id={id} />
                    ))}
                </ul>
            )}
        </div>
    );
}

function GroupDimmer({ name, records }: { name: string; records: readonly SceneRecord[] }) {
    const app = useApp();
    const start = useRef<GroupStart | null>(null);
    const { value, model, unit, total } = groupIntensity(records);
    const dim = (wanted: number): void => {
        start.current ??= groupStart(records);
        // Dark, all are alike: the ratios would be gone.
        for (const f of scaledTo(start.current, Math.max(wanted, unit.min))) app.edits.set(f.id, f.path, f.value);
    };
    const end = (): void => {
        start.current = null;
        app.edits.endGesture();
    };
    return (
        <Slider
            label={`Group ${name} intensity`}
            scale={logScale(unit.min, unit.max)}
            value={value}
            steps={dimmerSteps(unit)}
            spoken={`${number(value)} ${unit.spoken} ${total ? 'in all' : 'at most'}`}
            mark={model}
            onInput={dim}
            onEnd={end}
        />
    );
}
