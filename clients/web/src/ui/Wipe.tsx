import { useEffect, useLayoutEffect, useRef } from 'preact/hooks';
import { differences, factsInWords, type Shot, type Side } from '../state/compare';
import { useApp } from './context';

/** Of the picture's width, for a key. */
const STEP = 0.02;
const PAGE = 0.1;
const STEPS: Record<string, number> = {
    ArrowLeft: -STEP,
    ArrowDown: -STEP,
    ArrowRight: STEP,
    ArrowUp: STEP,
    PageDown: -PAGE,
    PageUp: PAGE,
    Home: -1,
    End: 1,
};
/** Ratios of sides that are nearer than this are those of one window: pictures have whole pixels. */
const SAME_ASPECT = 0.01;

/** The pictures that are not now's, each at its side of the line; now's is below them. */
export function WipePictures() {
    const { compare } = useApp();
    const sides = compare.sides.value;
    if (!sides) return null;
    const at = compare.at.value;
    const part = (of: number): string => `${(100 * of).toFixed(2)}%`;
    return (
        <>
            <Layer side={sides[0]} clip={`inset(0 ${part(1 - at)} 0 0)`} />
            <Layer side={sides[1]} clip={`inset(0 0 0 ${part(at)})`} />
        </>
    );
}

function Layer({ side, clip }: { side: Side; clip: string }) {
    const app = useApp();
    const box = useRef<HTMLDivElement>(null);
    const canvas = side === 'now' ? null : app.shotOf(side)?.canvas;
    const [w, h] = app.view.cssSize.value;
    useEffect(() => {
        if (canvas) box.current?.replaceChildren(canvas);
    }, [canvas]);
    if (!canvas) return null;
    // Its vertical field of view is that of the camera: in a window of another shape it is as high, and wider or narrower.
    const ratio = canvas.width / canvas.height / (w / h);
    const wide = Math.abs(ratio - 1) < SAME_ASPECT ? 1 : ratio;
    return (
        <div class="wipe-clip" style={{ clipPath: clip }} aria-hidden="true">
            <div ref={box} class="wipe-picture" style={{ width: `${100 * wide}%`, left: `${50 - 50 * wide}%` }} />
        </div>
    );
}

/** The line between two pictures: dragged, or moved by keys. */
export function WipeLine() {
    const app = useApp();
    const { compare } = app;
    const box = useRef<HTMLDivElement>(null);
    const line = useRef<HTMLDivElement>(null);
    const held = useRef(false);
    const sides = compare.sides.value;
    useLayoutEffect(() => {
        if (sides && compare.takeFocus()) line.current?.focus();
    }, [sides]);
    if (!sides) return null;
    const at = compare.at.value;

    const follow = (e: PointerEvent): void => {
        const { left, width } = box.current!.getBoundingClientRect();
        if (held.current) compare.moveTo((e.clientX - left) / width);
    };
    const grab = (e: PointerEvent): void => {
        if (e.button !== 0) return;
        line.current!.setPointerCapture(e.pointerId);
        held.current = true;
    };
    const letGo = (): void => {
        held.current = false;
    };
    const key = (e: KeyboardEvent): void => {
        const step = STEPS[e.key];
        if (e.ctrlKey || e.altKey || e.metaKey || e.shiftKey) return;
        if (step !== undefined) compare.moveTo(at + step);
        else if (e.key === 'Enter' || e.key === ' ') compare.flip();
        else if (e.key === 'Escape' || e.key.toLowerCase() === 'w') leave();
        else return;
        e.preventDefault();
        e.stopPropagation();
    };
    const leave = (): void => {
        compare.close();
        document.querySelector<HTMLElement>('.stage')?.focus();
    };
    return (
        <div ref={box} class="wipe" style={{ '--at': at.toFixed(4) }}>
            <div
                ref={line}
                class="wipe-line"
                role="slider"
                tabIndex={0}
                aria-label="Line between two pictures"
                aria-valuemin={0}
                aria-valuemax={100}
                aria-valuenow={Math.round(100 * at)}
                aria-valuetext={positionInWords(at, compare.nameOf(sides[0]), compare.nameOf(sides[1]))}
                title="Drag it, or use the arrow keys; Enter shows all of one picture, then all of the other"
                onPointerDown={grab}
                onPointerMove={follow}
                onPointerUp={letGo}
                onPointerCancel={letGo}
                onKeyDown={key}
            >
                <svg viewBox="0 0 36 36" aria-hidden="true">
                    <circle cx="18" cy="18" r="15" />
                    <path d="m14 12-6 6 6 6M22 12l6 6-6 6" />
                </svg>
            </div>
            <Tag side={sides[0]} other={sides[1]} class="is-left" />
            <Tag side={sides[1]} other={sides[0]} class="is-right" />
        </div>
    );
}

function positionInWords(at: number, left: string, right: string): string {
    if (at === 1) return `all ${left}`;
    if (at === 0) return `all ${right}`;
    return `${left} to ${Math.round(100 * at)} %, then ${right}`;
}

/** Which picture is at this side, how good it is, and what else than the light makes it differ. */
function Tag({ side, other, ...props }: { side: Side; other: Side; class: string }) {
    const app = useApp();
    const shot = app.shotOf(side);
    const beside = app.shotOf(other);
    return (
        <p class={`wipe-tag ${props.class}`}>
            <b>{app.compare.nameOf(side)}</b>
            {shot ? factsInWords(shot.facts) : 'is being computed…'}
            {side !== 'now' && shot && beside && <Differs shot={shot} beside={beside} />}
        </p>
    );
}

function Differs({ shot, beside }: { shot: Shot; beside: Shot }) {
    const list = differences(beside.facts, shot.facts);
    return list.length > 0 ? <em>{list.join(', ')}</em> : null;
}
