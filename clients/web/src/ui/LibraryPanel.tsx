import { useSignal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { number } from '../lib/format';
import { GLARE_TITLE, glareText, stemOf, type Facts } from '../state/luminaires';
import { useApp } from './context';
import { Polar } from './Polar';

/** Of a row, in pixels, and how many are in sight at most. */
const ROW_PX = 58;
const ROWS_IN_SIGHT = 5;
/** Hands tremble: more than that is a drag. */
const DRAG_SLOP = 6;
const HINT = 'Drag one into the picture, or choose one and press Enter.';

/** Luminaires of the server's asset folder, to be put into the scene. */
export function LibraryPanel() {
    const { library, imports, mayEdit, online } = useApp();
    const offered = imports.offered.value && mayEdit.value;
    useEffect(() => {
        if (online.value && offered) void library.load();
    }, [online.value, offered]);
    const all = library.assets.value;
    if (!mayEdit.value) return null;
    return (
        <section class="section library" aria-labelledby="library-title">
            <header class="section-head">
                <h2 id="library-title">Luminaires</h2>
                {all && <span class="count">{library.whole.value ? all.length : `${all.length}+`}</span>}
                {all && all.length > 0 && (
                    <input
                        type="search"
                        class="filter at-end"
                        placeholder="Search"
                        aria-label="Search luminaires by name or file"
                        value={library.search.value}
                        onInput={(e) => (library.search.value = e.currentTarget.value)}
                    />
                )}
            </header>
            {!offered && <p class="hint">This server was started without an asset folder (--assets): it has no luminaires to offer. An IES or EULUMDAT file of your own, dropped onto the page, hangs a lamp.</p>}
            {library.problem.value && <p class="problem">{library.problem.value}</p>}
            {all?.length === 0 && <p class="hint">The asset folder has no IES or EULUMDAT file.</p>}
            {all && all.length > 0 && <Rows />}
        </section>
    );
}

/** One stop of the Tab key. Only what is in sight is drawn and asked for. */
function Rows() {
    const { library } = useApp();
    const top = useSignal(0);
    const list = useRef<HTMLUListElement>(null);
    const found = library.found.value;
    const chosen = library.chosen.value;
    const at = chosen === null ? -1 : found.indexOf(chosen);
    const first = Math.max(0, Math.floor(top.value / ROW_PX) - 1);
    const shown = found.slice(first, first + ROWS_IN_SIGHT + 3);
    useEffect(() => library.want(shown), [shown.join('\n'), library.search.value, library.assets.value]);
    const choose = (i: number): void => {
        const asset = found[Math.min(found.length - 1, Math.max(0, i))];
        if (asset === undefined) return;
        library.chosen.value = asset;
        const element = list.current!;
        const y = found.indexOf(asset) * ROW_PX;
        if (y < element.scrollTop) element.scrollTop = y;
        if (y + ROW_PX > element.scrollTop + element.clientHeight) element.scrollTop = y + ROW_PX - element.clientHeight;
    };
    const onKeyDown = (e: KeyboardEvent): void => {
        const to: Record<string, number> = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: found.length - 1, PageDown: at + ROWS_IN_SIGHT, PageUp: at - ROWS_IN_SIGHT };
        if (e.ctrlKey || e.metaKey || e.altKey) return;
        if (e.key in to) choose(to[e.key]!);
        else if (e.key === 'Enter' && chosen !== null) void placeByKey(library.place(chosen, e.shiftKey ? [0.5, 0.5] : null));
        else return;
        e.preventDefault();
        e.stopPropagation();
    };
    return (
        <>
            <ul
                ref={list}
                class="library-list"
                role="listbox"
                tabIndex={0}
                aria-label="Luminaires: Enter puts the chosen one under the ceiling, Shift and Enter in the middle of the picture"
                aria-activedescendant={at >= 0 ? optionId(chosen!) : undefined}
                onScroll={(e) => (top.value = e.currentTarget.scrollTop)}
                onKeyDown={onKeyDown}
                onFocus={() => at < 0 && choose(0)}
            >
                <li class="library-room" role="presentation" style={{ height: `${found.length * ROW_PX}px` }} />
                {shown.map((asset, i) => (
                    <Row key={asset} asset={asset} index={first + i} count={found.length} onChoose={() => choose(first + i)} />
                ))}
            </ul>
            <div role="status" class="no-match">
                {found.length === 0 && <p>No luminaire matches “{library.search.value.trim()}”.</p>}
            </div>
            {chosen !== null && at >= 0 ? <Chosen asset={chosen} /> : found.length > 0 && <p class="hint">{HINT}</p>}
        </>
    );
}

const optionId = (asset: string): string => `luminaire-${asset.replace(/[^A-Za-z0-9_-]/g, (c) => `_${c.charCodeAt(0)}`)}`;

const FRAMES_TO_FOCUS = 120; // the handle is drawn once the scene has come back from the server

/** The handle of what was placed takes the focus: the arrow keys move it. */
async function placeByKey(placed: Promise<boolean>): Promise<void> {
    if (await placed) focusHandle(FRAMES_TO_FOCUS);
}

function focusHandle(frames: number): void {
    requestAnimationFrame(() => {
        const handle = document.querySelector<SVGElement>('.overlay .lamp.is-selected');
        if (handle) handle.focus();
        else if (frames > 0) focusHandle(frames - 1);
    });
}

interface RowProps {
    asset: string;
    index: number;
    count: number;
    onChoose(): void;
}

function Row({ asset, index, count, onChoose }: RowProps) {
    const { library } = useApp();
    const told = library.facts.value.get(asset);
    const start = useRef<{ x: number; y: number } | null>(null);
    const refused = typeof told === 'string';
    const move = (e: PointerEvent): void => {
        const from = start.current;
        if (!from || refused) return;
        if (!library.drag.peek() && Math.hypot(e.clientX - from.x, e.clientY - from.y) < DRAG_SLOP) return;
        library.dragTo(asset, e.clientX, e.clientY, placeInPicture(e.clientX, e.clientY));
    };
    const down = (e: PointerEvent & { currentTarget: HTMLElement }): void => {
        if (e.button !== 0) return;
        e.currentTarget.setPointerCapture(e.pointerId);
        start.current = { x: e.clientX, y: e.clientY };
        onChoose();
    };
    const end = (drop: boolean): void => {
        start.current = null;
        if (drop) library.drop();
        else library.cancelDrag();
    };
    return (
        <li
            id={optionId(asset)}
            role="option"
            class={`library-row ${refused ? 'is-refused' : ''}`}
            aria-selected={library.chosen.value === asset}
            aria-posinset={index + 1}
            aria-setsize={count}
            title={asset}
            style={{ transform: `translateY(${index * ROW_PX}px)` }}
            onPointerDown={down}
            onPointerMove={move}
            onPointerUp={() => end(true)}
            onPointerCancel={() => end(false)}
        >
            <Polar polar={told && !refused ? told.polar : null} />
            <span class="library-text">
                <b>{(told && !refused && told.name) || stemOf(asset)}</b>
                <small>{refused ? told.replace(/^\S+: /, '') : told ? figures(told) : '…'}</small>
            </span>
        </li>
    );
}

function figures({ fluxLm, watts }: Facts): string {
    const power = watts === null ? '' : ` · ${number(watts)} W · ${Math.round(fluxLm / watts)} lm/W`;
    return `${number(fluxLm)} lm${power}`;
}

/** Fractions of the picture; null: it is not there, or something lies over it. */
function placeInPicture(x: number, y: number): [number, number] | null {
    const stage = document.elementFromPoint(x, y)?.closest('.stage');
    const box = stage?.getBoundingClientRect();
    return box ? [(x - box.left) / box.width, (y - box.top) / box.height] : null;
}

function Chosen({ asset }: { asset: string }) {
    const { library, lux } = useApp();
    const told = library.facts.value.get(asset);
    if (!told) return <p class="hint">Reading {asset} …</p>;
    if (typeof told === 'string') return <p class="problem">{told}</p>;
    return (
        <div class="library-chosen">
            <div class="luminaire">
                <Polar polar={told.polar} label={`Polar diagram of ${told.name || stemOf(asset)}`} />
                <dl>
                    <dt>File</dt>
                    <dd>{asset}</dd>
                    <dt>Beam</dt>
                    <dd>{beam(told)}</dd>
                    <dt>Opening</dt>
                    <dd>{opening(told)}</dd>
                    {told.ugr && (
                        <>
                            <dt title={GLARE_TITLE}>UGR</dt>
                            <dd title={GLARE_TITLE}>{glareText(told.ugr)}</dd>
                        </>
                    )}
                </dl>
            </div>
            {told.warnings.map((w) => (
                <p key={w} class="hint">
                    {w}
                </p>
            ))}
            <div class="actions">
                <button type="button" class="button" title="Enter in the list" onClick={() => void placeByKey(library.place(asset, null))}>
                    {lux.reading.value ? 'Put on the picked point' : 'Hang under the ceiling'}
                </button>
                <button type="button" class="button" title="Shift + Enter in the list" onClick={() => void placeByKey(library.place(asset, [0.5, 0.5]))}>
                    Put in the middle
                </button>
            </div>
        </div>
    );
}

function beam({ beamDeg: [a, b] }: Facts): string {
    return Math.abs(a - b) < 1 ? `${Math.round(a)}°` : `${Math.round(a)}° × ${Math.round(b)}°`;
}

function opening({ size }: Facts): string {
    const mm = size.map((s) => Math.round(1000 * s));
    return mm.some((s) => s > 0) ? `${mm[0]} × ${mm[1]} mm${mm[2] ? `, ${mm[2]} mm high` : ''}` : 'a point';
}

/** What is dragged, beside the pointer, and where it would hang. */
export function DragGhost() {
    const { library } = useApp();
    const drag = library.drag.value;
    useEffect(() => {
        if (!drag) return;
        const onKey = (e: KeyboardEvent): void => {
            if (e.key !== 'Escape') return;
            e.stopPropagation();
            library.cancelDrag();
        };
        document.addEventListener('keydown', onKey, true);
        return () => document.removeEventListener('keydown', onKey, true);
    }, [drag !== null]);
    if (!drag) return null;
    const where = !drag.at || drag.on === undefined ? 'into the picture' : drag.on ? `on ${drag.on.id}, ${drag.on.point[1].toFixed(2)} m high` : 'nothing there to hang it on';
    return (
        <div class="drag-ghost" style={{ transform: `translate(${drag.x}px, ${drag.y}px)` }} aria-hidden="true">
            <Polar polar={library.factsOf(drag.asset)?.polar ?? null} />
            <span>{where}</span>
        </div>
    );
}
