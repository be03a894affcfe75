import { useSignal } from '@preact/signals';
import type { SceneRecord } from '../protocol/types';
import { stringOr } from '../protocol/types';
import { isOn, nameOf } from '../state/lights';
import { useApp } from './context';
import { LightRow, SoloButton } from './LightRow';

/** Rows beyond this, of a group or of those that stand alone, are found by name: a thousand sliders help nobody. */
const MAX_ROWS = 120;
const FILTER_FROM = 9;
/** A group of more is closed at first. */
const OPEN_UP_TO = 12;

/** The lamps of each group that has several, and those that stand alone. */
function grouped(ids: readonly string[], record: (id: string) => SceneRecord | undefined): { alone: string[]; groups: [string, string[]][] } {
    const groups = new Map<string, string[]>();
    const groupOf = (id: string): string => stringOr(record(id)?.group, '');
    for (const id of ids) if (groupOf(id)) groups.set(groupOf(id), [...(groups.get(groupOf(id)) ?? []), id]);
    const several = [...groups].filter(([, members]) => members.length > 1);
    const inGroup = new Set(several.flatMap(([, members]) => members));
    return { alone: ids.filter((id) => !inGroup.has(id)), groups: several };
}

export function LightList() {
    const app = useApp();
    const filter = useSignal('');
    const ids = app.scene.lamps.value;
    const wanted = filter.value.trim().toLowerCase();
    const record = (id: string): SceneRecord | undefined => app.scene.record(id);
    const matches = (id: string): boolean => id.toLowerCase().includes(wanted) || stringOr(record(id)?.group, '').toLowerCase().includes(wanted);
    const matching = new Set(wanted ? ids.filter(matches) : ids);
    const rowsOf = (members: readonly string[]): string[] => members.filter((id) => matching.has(id)).slice(0, MAX_ROWS);
    const { alone, groups } = grouped(ids, record);
    const shown = groups.map(([name, members]) => ({ name, members, rows: rowsOf(members) })).filter(({ rows }) => rows.length > 0);
    const lone = rowsOf(alone);
    const left = matching.size - lone.length - shown.reduce((sum, { rows }) => sum + rows.length, 0);
    return (
        <section class="section lights" aria-labelledby="lights-title">
            <header class="section-head">
                <h2 id="lights-title">Lights</h2>
                <span class="count">{ids.length}</span>
                {ids.length >= FILTER_FROM && (
                    <input
                        type="search"
                        class="filter"
                        placeholder="Filter"
                        aria-label="Filter lights by name"
                        value={filter.value}
                        onInput={(e) => (filter.value = e.currentTarget.value)}
                    />
                )}
            </header>
            <ul class="light-list">
                {lone.map((id) => (
                    <LightRow key={id} id={id} />
                ))}
            </ul>
            {shown.map(({ name, members, rows }) => (
                <LightGroup key={name} name={name} ids={members} rows={rows} open={wanted !== '' || members.length <= OPEN_UP_TO} />
            ))}
            {ids.length === 0 && app.scene.rev.value > 0 && <p class="hint">This scene has no lights.</p>}
            {left > 0 && <p class="hint">{left} more: type a part of a name above.</p>}
        </section>
    );
}

/** Lamps that are mixed together: switched and soloed as one, those without a row (`rows`: those that have one) too. */
function LightGroup({ name, ids, rows, open }: { name: string; ids: readonly string[]; rows: readonly string[]; open: boolean }) {
    const app = useApp();
    const toggled = useSignal<boolean | null>(null);
    const records = ids.map((id) => app.scene.record(id)).filter((r) => r !== undefined);
    const selected = app.selectedLight.value;
    const isOpen = toggled.value ?? (open || (selected !== null && ids.includes(selected)));
    const anyOn = records.some(isOn);
    const label = nameOf({ ...records[0]!, id: name }).replace(/^material\//, '');
    const switchAll = (): void => {
        void app.edits.transaction(ids.map((id) => ({ op: 'set', id, path: '/on', value: !anyOn })));
    };
    return (
        <div class="light-group">
            <div class="light-group-head">
                <button type="button" class="light-name" title={name} aria-expanded={isOpen} onClick={() => (toggled.value = !isOpen)}>
                    {isOpen ? '▾' : '▸'} {label} <span class="count">{ids.length}</span>
                </button>
                <button type="button" role="switch" class="button" aria-checked={anyOn} aria-label={`Group ${name} on`} onClick={switchAll}>
                    {anyOn ? 'Off' : 'On'}
                </button>
                <SoloButton name={`group ${name}`} ids={ids} />
            </div>
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
