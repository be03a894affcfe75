import { useSignal } from '@preact/signals';
import { useMemo, useRef } from 'preact/hooks';
import type { SceneRecord } from '../protocol/types';
import { stringOr } from '../protocol/types';
import { byLight, grouped } from '../state/groups';
import { fluxOf } from '../state/lights';
import { useApp } from './context';
import { LightGroup } from './LightGroup';
import { LightRow } from './LightRow';

/** Rows beyond this, of a group or of those that stand alone, are found by name: a thousand sliders help nobody. */
const MAX_ROWS = 120;
const FILTER_FROM = 9;
/** A group of more is closed at first. */
const OPEN_UP_TO = 12;

const lumensOf = (light: SceneRecord | undefined): number => (light && fluxOf(light)) ?? 0;

export function LightList() {
    const app = useApp();
    const filter = useSignal('');
    const field = useRef<HTMLInputElement>(null);
    const clear = (): void => {
        filter.value = '';
        field.current?.focus();
    };
    const ids = app.scene.lamps.value;
    const wanted = filter.value.trim().toLowerCase();
    const record = (id: string): SceneRecord | undefined => app.scene.record(id);
    const matches = (id: string): boolean => id.toLowerCase().includes(wanted) || stringOr(record(id)?.group, '').toLowerCase().includes(wanted);
    const matching = new Set(wanted ? ids.filter(matches) : ids);
    const rowsOf = (members: readonly string[]): string[] => members.filter((id) => matching.has(id)).slice(0, MAX_ROWS);
    // As they were when the list was made: a group that is dimmed does not move away under the hand.
    const lumens = useMemo(() => new Map(ids.map((id) => [id, lumensOf(app.scene.peek(id))])), [ids]);
    const { alone, groups } = grouped(ids, record);
    const shown = byLight(groups, (id) => lumens.get(id) ?? 0).map(([name, members]) => ({ name, members, rows: rowsOf(members) })).filter(({ rows }) => rows.length > 0);
    const lone = rowsOf(alone);
    const left = matching.size - lone.length - shown.reduce((sum, { rows }) => sum + rows.length, 0);
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
            <div role="status" class="no-match">
                {wanted && ids.length > 0 && matching.size === 0 && (
                    <>
                        <p>No lamp matches “{filter.value.trim()}”.</p>
                        <button type="button" class="button" onClick={clear}>
                            Clear the filter
                        </button>
                    </>
                )}
            </div>
        </section>
    );
}
