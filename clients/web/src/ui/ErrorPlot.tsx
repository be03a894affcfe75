import { useSignal } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { percent } from '../lib/format';
import { courseInWords, type Point } from '../state/convergence';
import { useApp } from './context';

const HEIGHT = 140;
/** Around the curves: room for the numbers. */
const LEFT = 48;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 22;
/** Fewer points than this are dots, too. */
const FEW = 12;

/** Error over time, both logarithmic: steady refinement is a straight line. */
export function ErrorPlot({ target }: { target: number | null }) {
    const { points } = useApp().convergence.course.value;
    const box = useRef<HTMLDivElement>(null);
    const width = useSignal(290);
    useEffect(() => {
        const fit = (): void => {
            width.value = Math.max(LEFT + RIGHT + 40, box.current?.clientWidth ?? 0);
        };
        const observer = new ResizeObserver(fit);
        fit();
        observer.observe(box.current!);
        return () => observer.disconnect();
    }, []);
    return (
        <figure class="error-plot">
            <div ref={box} role="img" aria-label={courseInWords(points, target)} data-points={points.length}>
                <Chart points={points} target={target} width={width.value} />
            </div>
            <figcaption aria-hidden="true">
                <span class="key-bound" title="With 95 % confidence the picture is off by no more">
                    at most
                </span>
                <span class="key-rel" title="How far it is off, as far as can be told">
                    about
                </span>
                {target !== null && (
                    <span class="key-target" title="Where refinement stops">
                        stop
                    </span>
                )}
                <span class="key-axis" title="Since this picture began, without the time in which it rested">seconds of work</span>
            </figcaption>
        </figure>
    );
}

/** Axes reach that far at least, so that they rarely change: seconds, and errors. */
const USUAL_S = [1, 10];
const USUAL_ERROR = [0.01, 1];

interface Axis {
    /** Whole decades. */
    ticks: number[];
    at(value: number): number;
}

/** From `from` pixels to `to`, logarithmic, over whole decades around the values. */
function axis(values: readonly number[], from: number, to: number): Axis {
    const low = Math.floor(Math.log10(Math.min(...values)));
    const high = Math.ceil(Math.log10(Math.max(...values)));
    const at = (v: number): number => from + ((to - from) * (Math.log10(v) - low)) / (high - low);
    return { at, ticks: Array.from({ length: high - low + 1 }, (_, i) => 10 ** (low + i)) };
}

function Chart({ points, target, width }: { points: readonly Point[]; target: number | null; width: number }) {
    const right = width - RIGHT;
    const bottom = HEIGHT - BOTTOM;
    const known = points.filter((p) => p.rel > 0);
    const errors = [...points.map((p) => p.bound), ...known.map((p) => p.rel), ...(target === null ? [] : [target])];
    const x = axis([...USUAL_S, ...points.map((p) => p.s)], LEFT, right);
    const y = axis([...USUAL_ERROR, ...errors], bottom, TOP);
    const places = (list: readonly Point[], value: (p: Point) => number): [number, number][] => list.map((p) => [x.at(p.s), y.at(value(p))]);
    return (
        <svg width={width} height={HEIGHT} aria-hidden="true">
            {x.ticks.map((s) => (
                <g key={s}>
                    <line x1={x.at(s)} x2={x.at(s)} y1={TOP} y2={bottom} />
                    <text x={x.at(s)} y={HEIGHT - 6} text-anchor="middle">
                        {Number(s.toPrecision(1))}
                    </text>
                </g>
            ))}
            {y.ticks.map((e) => (
                <g key={e}>
                    <line x1={LEFT} x2={right} y1={y.at(e)} y2={y.at(e)} />
                    <text x={LEFT - 5} y={y.at(e) + 4} text-anchor="end">
                        {percent(e)}
                    </text>
                </g>
            ))}
            {target !== null && <path class="key-target" d={`M${LEFT} ${y.at(target)}H${right}`} />}
            <Curve class="key-rel" places={places(known, (p) => p.rel)} />
            <Curve class="key-bound" places={places(points, (p) => p.bound)} />
        </svg>
    );
}

function Curve({ places, ...props }: { places: readonly [number, number][]; class: string }) {
    return (
        <g {...props}>
            <polyline points={places.map((p) => p.join()).join(' ')} />
            {places.length < FEW && places.map(([x, y], i) => <circle key={i} cx={x} cy={y} r="2.5" />)}
        </g>
    );
}
