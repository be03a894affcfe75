import { useEffect, useRef } from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { percent } from '../lib/format';
import { courseInWords, type Point } from '../state/convergence';
import { useApp } from './context';
import { useTheme } from './theme';

const HEIGHT = 140;

/** Error over time, both logarithmic: steady refinement is a straight line. */
export function ErrorPlot({ target }: { target: number | null }) {
    const { points } = useApp().convergence.course.value;
    const { contrast } = useTheme();
    const box = useRef<HTMLDivElement>(null);
    const plot = useRef<uPlot | null>(null);
    useEffect(() => {
        const { current } = box;
        if (!current) return;
        plot.current = new uPlot(options(current), dataOf([], null), current);
        const observer = new ResizeObserver(() => plot.current?.setSize({ width: current.clientWidth, height: HEIGHT }));
        observer.observe(current);
        return () => {
            observer.disconnect();
            plot.current?.destroy();
        };
    }, []);
    useEffect(() => plot.current?.setData(dataOf(points, target)), [points, target, contrast]);
    return (
        <figure class="error-plot">
            <div ref={box} role="img" aria-label={courseInWords(points, target)} data-points={points.length} />
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

/** Whole decades around the values. */
function decades(values: number[]): [number, number] {
    const low = Math.floor(Math.log10(Math.min(...values)));
    const high = Math.ceil(Math.log10(Math.max(...values)));
    return [10 ** low, 10 ** high];
}

/** Time, bound, estimate, target; the target goes from edge to edge. */
function dataOf(points: readonly Point[], target: number | null): uPlot.AlignedData {
    const [from, to] = decades([...USUAL_S, ...points.map((p) => p.s)]);
    const ends = <T,>(values: T[], end: T): T[] => [end, ...values, end];
    return [
        [from, ...points.map((p) => p.s), to],
        ends<number | null>(
            points.map((p) => p.bound),
            null,
        ),
        ends<number | null>(
            points.map((p) => (p.rel > 0 ? p.rel : null)),
            null,
        ),
        ends<number | null>(
            points.map(() => target),
            target,
        ),
    ];
}

/** Colours and the font are the page's, read whenever it is drawn: the theme may have changed. */
function options(box: HTMLElement): uPlot.Options {
    const style = (name: string) => () => getComputedStyle(box).getPropertyValue(name).trim();
    const each = (_: uPlot, __: number, min: number, max: number): number[] => {
        const splits = [];
        for (let power = Math.round(Math.log10(min)); power <= Math.round(Math.log10(max)); power++) splits.push(10 ** power);
        return splits;
    };
    const axis = (size: number, values: (v: number) => string): uPlot.Axis => ({
        size,
        gap: 5,
        font: `11px ${style('--font')()}`,
        stroke: style('--dim'),
        grid: { stroke: style('--track'), width: 1 },
        ticks: { show: false },
        splits: each,
        filter: (_, splits) => splits,
        values: (_, splits) => splits.map(values),
    });
    const shownValues = (u: uPlot): number[] => u.data.slice(1).flatMap((column) => [...column].filter((v) => typeof v === 'number'));
    return {
        width: box.clientWidth,
        height: HEIGHT,
        padding: [8, 10, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: {
            x: { time: false, distr: 3, range: (u) => decades([...u.data[0]]) },
            y: { distr: 3, range: (u) => decades([...USUAL_ERROR, ...shownValues(u)]) },
        },
        axes: [axis(22, (v) => String(Number(v.toPrecision(1)))), axis(48, percent)],
        series: [
            {},
            { stroke: style('--accent'), width: 2, points: { show: (u) => u.data[0].length < 12, size: 5, fill: style('--accent') } },
            { stroke: style('--info'), width: 1.5, points: { show: (u) => u.data[0].length < 12, size: 4, fill: style('--info') } },
            { stroke: style('--good'), width: 1, dash: [5, 4], points: { show: false } },
        ],
    };
}
