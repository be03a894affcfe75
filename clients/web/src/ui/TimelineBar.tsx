import { computed } from '@preact/signals';
import { useEffect, useMemo, useRef } from 'preact/hooks';
import type { App } from '../state/app';
import { COLOURS } from '../state/people';
import { may } from '../state/role';
import { didInWords, MOST_NAME_BYTES, SPEEDS, Timeline, timeOf, titleOf, type Moment } from '../state/timeline';
import '../style/timeline.css';
import { Choice } from './Choice';
import { useApp } from './context';
import { Icon } from './Icon';

const PAGE = 10;
const STEPS: Record<string, number> = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -PAGE, PageUp: PAGE, Home: -Infinity, End: Infinity };
/** Of the track's drawing: its height, and its marks' distance from its ends. */
const HEIGHT = 28;
const WIDTH = 1000;

/** One for the page: what was played goes on while the bar is closed and opened again. */
let known: Timeline | null = null;
function timelineOf(app: App): Timeline {
    known ??= new Timeline({
        call: (method, params) => app.call(method, params),
        onError: (error) => app.toasts.error(error),
        announce: (text) => app.toasts.announce(text),
        changed: app.pastChanged,
        moment: computed(() => app.view.settings.value.moment),
        look: (moment) => app.view.change({ moment }),
        shown: computed(() => app.meter.frame.value?.sceneRev ?? 0),
        revert: (rev) => {
            app.view.change({ moment: null });
            return app.edits.request('scene.revert', { scene_rev: rev });
        },
    });
    return known;
}

/** At the left of the line, and now at its right. */
function compareWithNow(app: App, moment: Moment): void {
    app.view.change({ moment: null });
    app.compare.moment.value = { rev: moment.rev, name: titleOf(moment, moment.rev) };
    app.compare.show('moment');
}

/** What the scene was, as a track: looked at by hand and key, named, compared, gone back to. */
export function TimelineBar() {
    const app = useApp();
    const timeline = timelineOf(app);
    if (!app.pastOpen.value) return null;
    const list = timeline.moments.value;
    const here = timeline.here.value;
    const named = list.filter((m) => m.name);
    const compared = app.compare.wantsMoment.value;
    const edits = may(app.role.value, 'edit');
    const now = timeline.isNow.value;
    const close = (): void => {
        timeline.playing.value = false;
        app.view.change({ moment: null });
        app.pastOpen.value = false;
        document.querySelector<HTMLElement>('.stage')?.focus();
    };
    return (
        <section class="timeline" aria-labelledby="timeline-title">
            <header>
                <h2 id="timeline-title">Timeline</h2>
                <Words moment={here} list={list} />
                <button type="button" class="icon-button" aria-label="Close the timeline" onClick={close}>
                    <Icon name="close" />
                </button>
            </header>
            <Track timeline={timeline} />
            <div class="timeline-tools">
                <button type="button" class="toggle" aria-pressed={timeline.playing.value} disabled={list.length < 2} onClick={() => void timeline.play()}>
                    {timeline.playing.value ? 'Pause' : 'Play'}
                </button>
                <Choice label="Steps a second" value={String(timeline.speed.value)} options={SPEEDS.map((s) => [String(s), String(s)])} onChange={(v) => (timeline.speed.value = Number(v))} />
                <button type="button" class="button" disabled={now} onClick={() => timeline.look(Infinity)}>
                    Now
                </button>
                <button
                    type="button"
                    class="toggle"
                    aria-pressed={compared}
                    disabled={now && !compared}
                    onClick={() => (compared ? app.compare.close() : here && compareWithNow(app, here))}
                >
                    Compare with now
                </button>
                <button type="button" class="button" disabled={now || !edits} title="An edit, for everybody: undo takes it back" onClick={() => void timeline.back()}>
                    Go back to here
                </button>
                <input
                    key={`${here?.rev} ${here?.name}`}
                    type="text"
                    aria-label="Name of this moment"
                    placeholder="Name this moment"
                    maxLength={MOST_NAME_BYTES}
                    disabled={!here || !edits}
                    defaultValue={here?.name ?? ''}
                    onChange={(e) => void timeline.name(e.currentTarget.value)}
                />
                <ul class="timeline-names" aria-label="Moments with names">
                    {named.map((m) => (
                        <li key={m.rev}>
                            <button type="button" class="toggle" aria-pressed={m === here} onClick={() => timeline.look(list.indexOf(m))}>
                                {m.name}
                            </button>
                        </li>
                    ))}
                </ul>
            </div>
        </section>
    );
}

function Words({ moment, list }: { moment: Moment | undefined; list: readonly Moment[] }) {
    if (!moment) return <p class="hint">…</p>;
    return (
        <p class="timeline-words">
            {moment.at && <time dateTime={moment.at.toISOString()}>{timeOf(moment.at)}</time>} {moment.who && <b>{moment.who}</b>} {didInWords(moment, list)}
        </p>
    );
}

const spoken = (m: Moment | undefined, list: readonly Moment[], now: boolean): string =>
    m ? [now ? 'Now' : '', m.name, timeOf(m.at), [m.who, didInWords(m, list)].filter(Boolean).join(' ')].filter(Boolean).join(', ') : 'Nothing is known yet';

function Track({ timeline }: { timeline: Timeline }) {
    const box = useRef<HTMLDivElement>(null);
    const held = useRef(false);
    const list = timeline.moments.value;
    const index = timeline.index.value;
    const last = Math.max(1, list.length - 1);
    const x = (i: number): number => (list.length < 2 ? WIDTH : (i / last) * WIDTH);
    const follow = (e: PointerEvent): void => {
        const { left, width } = box.current!.getBoundingClientRect();
        if (held.current) timeline.look(Math.round(((e.clientX - left) / width) * last));
    };
    const grab = (e: PointerEvent): void => {
        if (e.button !== 0) return;
        timeline.playing.value = false;
        held.current = true;
        box.current!.setPointerCapture(e.pointerId);
        box.current!.focus();
        follow(e);
    };
    const key = (e: KeyboardEvent): void => {
        const step = STEPS[e.key];
        if (step === undefined || e.ctrlKey || e.altKey || e.metaKey || e.shiftKey) return;
        timeline.playing.value = false;
        timeline.look(index + step);
        e.preventDefault();
        e.stopPropagation();
    };
    const letGo = (): void => {
        held.current = false;
    };
    useEffect(() => box.current?.focus(), []); // whoever opened it goes on from there
    const marks = useMemo(() => marksOf(list, x), [list]);
    return (
        <div
            ref={box}
            class="timeline-track"
            role="slider"
            tabIndex={0}
            aria-label="Moment that is shown"
            aria-valuemin={1}
            aria-valuemax={Math.max(1, list.length)}
            aria-valuenow={index + 1}
            aria-valuetext={spoken(list[index], list, timeline.isNow.value)}
            onPointerDown={grab}
            onPointerMove={follow}
            onPointerUp={letGo}
            onPointerCancel={letGo}
            onKeyDown={key}
        >
            <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} preserveAspectRatio="none" aria-hidden="true">
                {marks}
            </svg>
            {list.map((m, i) => m.name && <i key={m.rev} class="timeline-name" style={{ left: `${x(i) / 10}%` }} aria-hidden="true" />)}
            <i class="timeline-here" style={{ left: `${x(index) / 10}%` }} aria-hidden="true" />
        </div>
    );
}

/** A stroke each, in the colour of whoever made it; the legend is in words, above. */
function marksOf(list: readonly Moment[], x: (i: number) => number) {
    const paths = new Map<string, string>();
    list.forEach((m, i) => paths.set(m.who, `${paths.get(m.who) ?? ''}M${x(i).toFixed(1)} 9v10`));
    return [...paths].map(([who, d], k) => <path key={who} d={d} style={{ stroke: who ? COLOURS[k % COLOURS.length] : undefined }} vector-effect="non-scaling-stroke" />);
}
