import { useSignal } from '@preact/signals';
import { useMemo, useRef } from 'preact/hooks';
import type { SceneRecord } from '../protocol/types';
import { fluxOf } from '../state/lights';
import { linesOf, type Line } from '../state/listing';
import { AddLamp } from './AddLamp';
import { useApp } from './context';
import { Editing } from './Editing';
import { LightGroup } from './LightGroup';
import { LightRow } from './LightRow';
import { useLines } from './lines';

const FILTER_FROM = 9;
/** A group of more is closed at first. */
const OPEN_UP_TO = 12;

const lumensOf = (light: SceneRecord | undefined): number => (light && fluxOf(light)) ?? 0;

export function LightList() {
    const app = useApp();
    const filter = useSignal('');
    const toggled = useSignal<ReadonlyMap<string, boolean>>(new Map());
    const field = useRef<HTMLInputElement>(null);
    const clear = (): void => {
        filter.value = '';
        field.current?.focus();
    };
    const ids = app.scene.lamps.value;
    const selected = app.lamps.selected.value;
    const wanted = filter.value.trim();
    const lumens = useMemo(() => new Map(ids.map((id) => [id, lumensOf(app.scene.peek(id))])), [ids]);
    const { lines, n } = linesOf({
        ids,
        record: (id) => app.scene.record(id),
        filter: wanted,
        lumens: (id) => lumens.get(id) ?? 0,
        isOpen: (group, members) =>
            toggled.value.get(group) ?? (members.length <= OPEN_UP_TO || (selected !== null && members.includes(selected))),
    });
    const toggle = (group: string, open: boolean): void => {
        toggled.value = new Map(toggled.value).set(group, open);
    };
    return (
        <section class="section lights" aria-labelledby="lights-title">
            <header class="section-head">
                <h2 id="lights-title">Lights</h2>
                <span class="count">{ids.length}</span>
                {(ids.length >= FILTER_FROM || wanted) && (
                    <input
                        ref={field}
                        type="search"
                        class="filter"
                        placeholder="Filter"
                        title="Parts of a name, a group, or a kind"
                        aria-label="Filter lights by name"
                        value={filter.value}
                        onInput={(e) => (filter.value = e.currentTarget.value)}
                    />
                )}
                <Editing>
                    <AddLamp />
                </Editing>
            </header>
            <Lines lines={lines} selected={selected} onToggle={toggle} />
            {ids.length === 0 && app.scene.rev.value > 0 && <p class="hint">This scene has no lights.</p>}
            <div role="status" class="no-match">
                {wanted && ids.length > 0 && n === 0 && (
                    <>
                        <p>No lamp matches “{wanted}”.</p>
                        <button type="button" class="button" onClick={clear}>
                            Clear the filter
                        </button>
                    </>
                )}
            </div>
        </section>
    );
}

/** One stop of the Tab key: the arrow keys go from line to line. Of a long list only what is in sight is there. */
function Lines({ lines, selected, onToggle }: { lines: Line[]; selected: string | null; onToggle(group: string, open: boolean): void }) {
    const { list, shown, height, active, onKeyDown, onFocus, placeOf } = useLines(lines, selected);
    const order = (): string[] => lines.flatMap((l) => ('id' in l ? [l.id] : []));
    return (
        <ul
            ref={list}
            class={`light-list ${height === null ? '' : 'is-long'}`}
            style={height === null ? undefined : { height: `${height}px` }}
            aria-label="Lamps: arrow up and down go from one to the next, with Shift they select, Control and Space adds one, Delete removes"
            onKeyDown={onKeyDown}
            onFocusIn={onFocus}
        >
            {shown.map((i) => {
                const line = lines[i]!;
                const place = { ...placeOf(i), reachable: i === active };
                return 'id' in line ? (
                    <LightRow key={line.key} id={line.id} inGroup={line.inGroup} place={place} order={order} />
                ) : (
                    <LightGroup key={line.key} name={line.group} ids={line.ids} isOpen={line.isOpen} place={place} onToggle={onToggle} />
                );
            })}
        </ul>
    );
}
