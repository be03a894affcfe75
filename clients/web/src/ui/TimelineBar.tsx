import { computed, useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useEffect, useMemo, useRef } from 'preact/hooks';
import type { App } from '../state/app';
import { COLOURS } from '../state/people';
import { may } from '../state/role';
import { didInWords, fittingName, SPEEDS, Timeline, timeOf, titleOf, type Moment } from '../state/timeline';
import '../style/timeline.css';
import { Choice } from './Choice';
import { useApp } from './context';
import { toStage } from './focus';
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
        onError: (error) => app.report(error),
        announce: (text) => app.toasts.announce(text),
        open: app.pastOpen,
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
    const rev = app.view.settings.value.moment;
    const close = (): void => {
        timeline.playing.value = false;
        app.view.change({ moment: null });
        app.pastOpen.value = false;
        toStage();
    };
    return (
        <section class="timeline" aria-labelledby="timeline-title">
            <header>
                <h2 id="timeline-title">Timeline</h2>
                <Words moment={here} list={list} rev={rev} />
                <button type="button" class="icon-button" aria-label="Close the timeline" onClick={close}>
                    <Icon name="close" />
                </button>
            </header>
            <Track timeline={timeline} rev={rev} />
            <div class="timeline-tools">
                <Act class="toggle" aria-pressed={timeline.playing.value} off={list.length < 2} run={() => void timeline.play()}>
                    {timeline.playing.value ? 'Pause' : 'Play'}
                </Act>
                <Choice label="Steps a second" value={String(timeline.speed.value)} options={SPEEDS.map((s) => [String(s), String(s)])} onChange={(v) => (timeline.speed.value = Number(v))} />
                <Act off={now} run={() => timeline.look(Infinity)}>
                    Now
                </Act>
                <Act class="toggle" aria-pressed={compared} off={!compared && (now || !here)} run={() => (compared ? app.compare.close() : compareWithNow(app, here!))}>
                    Compare with now
                </Act>
                <Act off={now || !here || !edits} title="An edit, for everybody: undo takes it back" run={() => void timeline.back()}>
                    Go back to here
                </Act>
                <NameField timeline={timeline} edits={edits} />
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

interface Press {
    off: boolean;
    run(): void;
    children: ComponentChildren;
    class?: string;
    title?: string;
    'aria-pressed'?: boolean;
}

/** What its press does may leave it nothing to do: it keeps the focus, where one that is disabled would lose it. */
function Act({ off, run, children, ...more }: Press) {
    return (
        <button type="button" class="button" aria-disabled={off} onClick={() => !off && run()} {...more}>
            {children}
        </button>
    );
}

/** What is typed is for the moment at which it was begun, whatever is edited meanwhile. */
function NameField({ timeline, edits }: { timeline: Timeline; edits: boolean }) {
    const draft = useSignal<{ rev: number; text: string } | null>(null);
    const here = timeline.here.value;
    const typed = draft.value;
    const listed = (rev: number): Moment | undefined => timeline.moments.value.find((m) => m.rev === rev);
    const of = typed && typed.rev !== here?.rev ? `the moment of ${titleOf(listed(typed.rev), typed.rev)}` : 'this moment';
    const commit = async (stays: boolean): Promise<void> => {
        const d = draft.peek();
        if (!d) return;
        const done = await timeline.name(d.text, d.rev);
        if (draft.peek() !== d) return;
        const rev = (listed(d.rev) ?? timeline.here.peek())?.rev;
        draft.value = done || !stays || rev === undefined ? null : { ...d, rev };
    };
    return (
        <input
            type="text"
            aria-label={`Name of ${of}`}
            title={`Name of ${of}`}
            placeholder="Name this moment"
            disabled={!edits}
            readOnly={!here && !typed}
            value={typed?.text ?? here?.name ?? ''}
            onInput={(e) => {
                const box = e.currentTarget;
                if (!e.isComposing) box.value = fittingName(box.value);
                draft.value = { rev: typed?.rev ?? here!.rev, text: box.value };
            }}
            onKeyDown={(e) => {
                if (e.key === 'Enter' && !e.isComposing) void commit(true);
                else if (e.key === 'Escape') draft.value = null;
            }}
            onBlur={() => void commit(false)}
        />
    );
}

const unlisted = (rev: number): string => `Revision ${rev} is not listed any more`;

function Words({ moment, list, rev }: { moment: Moment | undefined; list: readonly Moment[]; rev: number | null }) {
    if (!moment) return <p class="hint">{rev !== null && list.length > 0 ? unlisted(rev) : '…'}</p>;
    return (
        <p class="timeline-words">
            {moment.at && <time dateTime={moment.at.toISOString()}>{timeOf(moment.at)}</time>} {moment.who && <b>{moment.who}</b>} {didInWords(moment, list)}
        </p>
    );
}

function spoken(m: Moment | undefined, list: readonly Moment[], rev: number | null): string {
    if (!m) return rev !== null && list.length > 0 ? unlisted(rev) : 'Nothing is known yet';
    return [rev === null ? 'Now' : '', m.name, timeOf(m.at), [m.who, didInWords(m, list)].filter(Boolean).join(' ')].filter(Boolean).join(', ');
}

function Track({ timeline, rev }: { timeline: Timeline; rev: number | null }) {
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
        timeline.step(step);
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
            aria-valuetext={spoken(timeline.here.value, list, rev)}
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
