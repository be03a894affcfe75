import { useRef } from 'preact/hooks';
import { number } from '../lib/format';
import { logScale } from '../lib/scale';
import type { SceneRecord } from '../protocol/types';
import { groupIntensity, groupStart, scaledTo, type GroupStart } from '../state/groups';
import { dimmedAsInModel, isOn, nameOf } from '../state/lights';
import { useApp } from './context';
import { dimmerSteps, ModelButton, SoloButton } from './LightRow';
import { lineProps, type Place } from './lines';
import { Slider } from './Slider';

interface Props {
    name: string;
    ids: readonly string[];
    isOpen: boolean;
    place: Place;
    onToggle(group: string, open: boolean): void;
}

/** The head of lamps that are mixed together: dimmed, switched and soloed as one. */
export function LightGroup({ name, ids, isOpen, place, onToggle }: Props) {
    const app = useApp();
    const records = ids.map((id) => app.scene.record(id)).filter((r) => r !== undefined);
    if (records.length === 0) return null;
    const anyOn = records.some(isOn);
    const tabIndex = place.reachable ? 0 : -1;
    const { value, model, unit, total } = groupIntensity(records);
    const label = nameOf({ ...records[0]!, id: name }).replace(/^material\//, '');
    const switchAll = (): void => {
        void app.edits.transaction(ids.map((id) => ({ op: 'set', id, path: '/on', value: !anyOn })));
    };
    return (
        <li {...lineProps(place)} class={`light-group ${anyOn ? '' : 'is-off'}`}>
            <div class="light-group-head">
                <button
                    type="button"
                    class="light-name"
                    data-column="name"
                    tabIndex={tabIndex}
                    title={name}
                    aria-expanded={isOpen}
                    onClick={(e) => (e.ctrlKey || e.metaKey || e.shiftKey ? app.selection.set(ids) : onToggle(name, !isOpen))}
                >
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
                    tabIndex={tabIndex}
                    onClick={() => void app.edits.transaction(ids.map(dimmedAsInModel))}
                />
                <button
                    type="button"
                    role="switch"
                    class="button"
                    data-column="on"
                    tabIndex={tabIndex}
                    aria-checked={anyOn}
                    aria-label={`Group ${name} on`}
                    disabled={!app.mayEdit.value}
                    onClick={switchAll}
                >
                    {anyOn ? 'Off' : 'On'}
                </button>
                <button
                    type="button"
                    class="solo is-back"
                    data-column="select"
                    tabIndex={tabIndex}
                    aria-label={`Select the ${ids.length} lamps of group ${name}`}
                    title="Select all of them: each number is then for all"
                    onClick={() => app.selection.set(ids)}
                >
                    ▣
                </button>
                <SoloButton name={name} label={`group ${name}`} n={ids.length} tabIndex={tabIndex} />
            </div>
            <GroupDimmer label={`Group ${name} intensity`} records={records} tabIndex={tabIndex} />
        </li>
    );
}

/** All of them, with the ratios as they are. */
export function GroupDimmer({ label, records, tabIndex }: { label: string; records: readonly SceneRecord[]; tabIndex: number }) {
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
            label={label}
            disabled={!app.mayEdit.value}
            tabIndex={tabIndex}
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
