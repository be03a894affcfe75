import { useEffect, useRef } from 'preact/hooks';
import { useApp } from './context';

const WIDTH = 132;
const HEIGHT = 22;

/** Two curves over the last frames: server time per frame, and from the hand to the picture. */
export function Sparkline() {
    const app = useApp();
    const canvas = useRef<HTMLCanvasElement>(null);
    const tick = app.meter.ticks.value;
    useEffect(() => {
        if (canvas.current) draw(canvas.current, app.meter.frameHistory.values, app.meter.latencyHistory.values);
    }, [tick]);
    return (
        <div class="sparkline" title="Milliseconds per frame (bright) and from your hand to the picture (blue)">
            <canvas ref={canvas} role="img" aria-label="History of frame time and latency" />
        </div>
    );
}

function draw(canvas: HTMLCanvasElement, frames: readonly number[], latencies: readonly number[]): void {
    const ratio = window.devicePixelRatio;
    canvas.width = Math.round(WIDTH * ratio);
    canvas.height = Math.round(HEIGHT * ratio);
    const context = canvas.getContext('2d');
    if (!context) return;
    context.scale(ratio, ratio);
    context.lineWidth = 1.25;
    context.lineJoin = 'round';
    const style = getComputedStyle(canvas);
    // One scale for both, so that the share of the server in the latency can be seen.
    const top = Math.max(20, ...frames, ...latencies);
    curve(context, latencies, top, style.getPropertyValue('--info'));
    curve(context, frames, top, style.getPropertyValue('--accent'));
}

function curve(context: CanvasRenderingContext2D, values: readonly number[], top: number, colour: string): void {
    if (values.length < 2) return;
    const step = WIDTH / (values.length - 1);
    context.beginPath();
    values.forEach((v, i) => context.lineTo(i * step, HEIGHT - 1 - (v / top) * (HEIGHT - 2)));
    context.strokeStyle = colour.trim();
    context.stroke();
}
