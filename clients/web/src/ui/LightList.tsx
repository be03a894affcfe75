import { useSignal } from '@preact/signals';
import { useApp } from './context';
import { LightRow } from './LightRow';

/** Rows beyond this are found by name: a list of a thousand sliders helps nobody. */
const MAX_ROWS = 120;
const FILTER_FROM = 9;
const GLOWING = 'Lit by glowing surfaces: they cannot be dimmed here yet.';

export function LightList() {
    const app = useApp();
    const filter = useSignal('');
    const ids = app.scene.list('light').value;
    const wanted = filter.value.trim().toLowerCase();
    const matching = wanted ? ids.filter((id) => id.toLowerCase().includes(wanted)) : ids;
    const shown = matching.slice(0, MAX_ROWS);
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
                {shown.map((id) => (
                    <LightRow key={id} id={id} />
                ))}
            </ul>
            {ids.length === 0 && app.scene.rev.value > 0 && <p class="hint">{app.scene.glows() ? GLOWING : 'This scene has no lights.'}</p>}
            {matching.length > shown.length && (
                <p class="hint">{matching.length - shown.length} more: type a part of a name above.</p>
            )}
        </section>
    );
}
