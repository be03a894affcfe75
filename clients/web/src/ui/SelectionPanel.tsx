import { useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import type { SceneRecord } from '../protocol/types';
import { alignOps, aimOps, anglesOfAll, distributeOps, yawOf, yawOps } from '../state/arrange';
import { isAimed } from '../state/lamp_make';
import { isLamp, isOn } from '../state/lights';
import { common, fieldOfAll, hasPlace, inWords } from '../state/many';
import { anchorOf } from '../state/placement';
import { ColourFields } from './ColourFields';
import { useApp } from './context';
import { DimFields } from './DimFields';
import { Editing } from './Editing';
import { useFocusAfter } from './focus';
import { GroupField } from './GroupField';
import { Icon } from './Icon';
import { GroupDimmer } from './LightGroup';
import { NumberField } from './NumberField';

const AXES = ['X', 'Y', 'Z'] as const;
/** Of most ceilings that are laid of tiles, metres. */
const USUAL_TILE_M = 0.6;

/** Several lamps and objects as one: each number is for all of them, and one step of undo. Where they differ it says "mixed". */
export function SelectionPanel() {
    const app = useApp();
    const last = useRef<readonly SceneRecord[]>([]);
    const records = app.selection.many.value.length > 0 ? app.selection.records() : [];
    // Copies are selected before the server has told of them: till then the panel, and the focus in it, stay.
    if (records.length > 0 || app.selection.many.value.length === 0) last.current = records;
    return last.current.length > 0 ? <Several records={last.current} /> : null;
}

function Several({ records }: { records: readonly SceneRecord[] }) {
    const app = useApp();
    const box = useRef<HTMLElement>(null);
    useFocusAfter(box);
    useLayoutEffect(keepInSight, []);
    const wholes = app.selection.wholes();
    const lamps = records.filter(isLamp);
    const anyOn = lamps.some(isOn);
    return (
        <section ref={box} class="section docked selection" aria-labelledby="selection-title">
            <header class="section-head">
                <h2 id="selection-title" tabIndex={-1}>
                    {inWords(records)} selected
                </h2>
                {lamps.length > 0 && (
                    <>
                        <Editing>
                            <button type="button" role="switch" class="button" aria-checked={anyOn} aria-label="Selected lamps on" onClick={() => void app.selection.switchAll()}>
                                {anyOn ? 'Off' : 'On'}
                            </button>
                        </Editing>
                        <button type="button" class="button" aria-label="Solo the selected lamps" title="Only these, in your view alone" onClick={() => app.selection.solo()}>
                            S
                        </button>
                    </>
                )}
                <button type="button" class="icon-button" aria-label="Select nothing" title="Esc" onClick={() => app.selection.clear()}>
                    <Icon name="close" />
                </button>
            </header>
            <Editing>
                <Numbers key={app.selection.many.value.join(' ')}>
                    {lamps.length > 0 && (
                        <>
                            <GroupDimmer label="Selected lamps intensity" records={lamps} tabIndex={0} />
                            <DimFields lights={lamps} />
                            <ColourFields lights={lamps} />
                        </>
                    )}
                    <Place records={wholes} />
                    <Turned records={wholes} />
                    <Arrange records={wholes.filter(hasPlace)} />
                    {lamps.length > 0 && (
                        <GroupField
                            name="Selected lamps"
                            lights={lamps}
                            onCommit={(group) => void app.selection.apply(fieldOfAll(lamps, '/group', group || null), group ? `In group ${group}` : 'In no group')}
                        />
                    )}
                </Numbers>
                {/* It stays when others are selected, and the focus on it: Copy again copies the copies. */}
                <div class="actions">
                    <button type="button" class="button" title="Ctrl + D" onClick={() => void app.selection.duplicate()}>
                        Copy
                    </button>
                    <button type="button" class="button" title="Delete" aria-label="Remove what is selected" onClick={() => void app.selection.remove()}>
                        Remove
                    </button>
                </div>
            </Editing>
        </section>
    );
}

/** The panel lies over the lower end of the lists: the line from which it was opened stays to be seen. */
function keepInSight(): void {
    const { activeElement } = document;
    if (activeElement?.closest('.sections')) activeElement.scrollIntoView({ block: 'nearest' });
}

const toTitle = (): void => document.getElementById('selection-title')?.focus({ preventScroll: true });

/** Of these lamps and objects: for others there are others, and a focus in one of them goes to what is selected now. */
function Numbers({ children }: { children: ComponentChildren }) {
    const box = useRef<HTMLDivElement>(null);
    useFocusAfter(box, toTitle);
    return (
        <div ref={box} class="light-details">
            {children}
        </div>
    );
}

function Place({ records }: { records: readonly SceneRecord[] }) {
    const app = useApp();
    const placed = records.filter(hasPlace);
    if (placed.length === 0) return null;
    return (
        <div class="fields" role="group" aria-label="Position of all in metres">
            {AXES.map((name, axis) => {
                const v = common(placed.map((r) => anchorOf(r)[axis]!));
                return (
                    <NumberField
                        key={name}
                        label={name}
                        value={v === null ? null : Number(v.toFixed(3))}
                        unit="m"
                        min={-1e9}
                        max={1e9}
                        step={app.snap.gridM.value}
                        onCommit={(to) => void app.selection.apply(alignOps(placed, axis, to), `All at ${name} ${to} metres`)}
                    />
                );
            })}
        </div>
    );
}

function Turned({ records }: { records: readonly SceneRecord[] }) {
    const app = useApp();
    const step = app.snap.angleDeg.value;
    const round = (v: number | null): number | null => (v === null ? null : Number(v.toFixed(1)) + 0);
    const field = (label: string, value: number | null, min: number, max: number, ops: (v: number) => ReturnType<typeof aimOps>) => (
        <NumberField label={label} value={round(value)} unit="°" {...{ min, max, step }} onCommit={(v) => void app.selection.apply(ops(v), `${label} ${v} degrees`)} />
    );
    if (records.every(isAimed)) {
        const { tilt, turn } = anglesOfAll(records);
        return (
            <div class="fields" role="group" aria-label="Aim of all">
                {field('Tilt', tilt, 0, 180, (v) => aimOps(records, { tilt: v }))}
                {field('Turn', turn, -360, 360, (v) => aimOps(records, { turn: v }))}
            </div>
        );
    }
    const yaws = records.map(yawOf);
    if (yaws.some((y) => y === null)) return null;
    return (
        <div class="fields" role="group" aria-label="Turn of all about the vertical">
            {field('Turn', common(yaws), -3600, 3600, (v) => yawOps(records, v))}
        </div>
    );
}

function Arrange({ records }: { records: readonly SceneRecord[] }) {
    const app = useApp();
    const tile = useSignal(USUAL_TILE_M);
    if (records.length === 0) return null;
    const row = (label: string, title: string, names: readonly string[], least: number, act: (axis: number) => unknown) => (
        <div class="arrange" role="group" aria-label={label} title={title}>
            <span class="field-label">{label}</span>
            {names.map((name, axis) => (
                <button key={name} type="button" class="toggle" aria-label={`${label} ${name}`} disabled={records.length < least} onClick={() => void act(axis)}>
                    {name}
                </button>
            ))}
        </div>
    );
    const align = (axis: number): Promise<boolean> => app.selection.apply(alignOps(records, axis, anchorOf(records[0]!)[axis]!), `Aligned along ${AXES[axis]}`);
    const spread = (axis: number): Promise<boolean> => app.selection.apply(distributeOps(records, axis), `Equal gaps along ${AXES[axis]}`);
    return (
        <>
            <div class="fields">
                {row('Align', 'To the one that was selected first', AXES, 2, align)}
                {row('Even gaps', 'Between the outermost two', AXES, 3, spread)}
            </div>
            <div class="fields is-aim">
                <NumberField label="Ceiling tile" unit="m" min={0.05} max={20} step={0.05} value={tile.value} onCommit={(v) => (tile.value = v)} />
                <button type="button" class="toggle" title="Tiles of that size, cut alike at both ends of the floor: each goes into the nearest" onClick={() => void app.selection.intoTiles(tile.value)}>
                    Into tiles
                </button>
            </div>
        </>
    );
}
