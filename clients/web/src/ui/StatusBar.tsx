import type { ComponentChildren } from 'preact';
import { fixed, number, percent, si } from '../lib/format';
import { FRESH, LOOSE, opacityOf } from '../state/convergence';
import type { FrameNumbers } from '../state/frame_meter';
import { useApp } from './context';
import { Sparkline } from './Sparkline';

/** The most important first. What finds no room in the line goes into the next; but for the curves, which are left out. */
export function StatusBar() {
    const app = useApp();
    const frame = app.meter.frame.value;
    const server = app.meter.server.value;
    const rtt = app.meter.roundTripMs.value;
    const latency = app.meter.latencyMs.value;
    return (
        <footer class="status" aria-label="Status">
            <Converged />
            <Item label="frame" title="Time the server took for the last frame that it rendered">
                {server ? `${fixed(server.ms, server.ms < 100 ? 1 : 0)} ms` : '–'}
            </Item>
            <Item label="fps" title="Frames drawn here per second">
                {fixed(app.meter.fps.value, 0)}
            </Item>
            <Item label="latency" title="From your hand to the picture that shows it">
                {latency === null ? '–' : `${fixed(latency, 0)} ms`}
            </Item>
            <Item label="rtt" title="Round trip of a message">
                {rtt === null ? '–' : `${fixed(rtt, rtt < 10 ? 1 : 0)} ms`}
            </Item>
            <Item label="rays" title="Rays traced per second in that frame">
                {server ? `${si(server.raysPerSecond)}/s` : '–'}
            </Item>
            <Item label="net" title="Received here">
                {number(Math.round(app.meter.kbits.value))} kbit/s
            </Item>
            <Item label="codec" title="How the picture came">
                {server?.coding ?? '–'}
            </Item>
            <Item label="line" title="What the line brings here, as the server reckons it from pictures that arrived: it chooses the codec by that">
                {server?.lineBits ? `${si(server.lineBits)}bit/s` : '–'}
            </Item>
            <Item label="rev" title="Revision of the scene in the picture">
                {frame ? number(frame.sceneRev) : '–'}
            </Item>
            <Item label="size" title="Size of the picture in pixels">
                {frame ? `${frame.width}×${frame.height}` : '–'}
            </Item>
            <Sparkline />
        </footer>
    );
}

/** A method that makes one frame is done, which says nothing about how near the truth it is. */
function word({ converged, rough, spp }: FrameNumbers): string {
    if (rough) return 'rough';
    if (!converged) return 'refining';
    return spp > 1 ? 'converged' : 'done';
}

/** How good the picture is: samples per pixel, what error is left, and whether it goes on improving. */
function Converged() {
    const app = useApp();
    const frame = app.meter.frame.value;
    if (app.connection.value.at !== 'online') return <span class="quality">not connected</span>;
    if (app.stalled.value) return <span class="quality">no answer from the server</span>;
    if (!frame) return <span class="quality">no picture yet</span>;
    if (app.comeback.isStale.value) return <span class="quality">old picture</span>;
    // The numbers are of the picture that is about to go.
    if (app.view.pending.value || app.scene.rev.value > frame.sceneRev) return <span class="quality">updating</span>;
    return (
        <span class={`quality ${frame.converged ? 'is-converged' : ''}`} title="Samples per pixel (spp), and how far the picture is off at most, with 95 % confidence: root mean square error by mean luminance">
            <span class="quality-mark" aria-hidden="true" />
            <span class="quality-word">{word(frame)}</span>
            {!frame.rough && <b>{number(frame.spp)} spp</b>}
            {frame.error !== null && <ErrorBound bound={frame.error} />}
        </span>
    );
}

/** Paler the more of it was measured in pictures before this one. */
function ErrorBound({ bound }: { bound: number }) {
    const fresh = useApp().meter.server.value?.error?.fresh ?? 1;
    if (bound > LOOSE)
        return (
            <span class="quality-error" title={`Less than ${percent(bound)}: too few pixels were compared so far to tell more`}>
                error being measured
            </span>
        );
    const title = fresh < FRESH ? 'Measured in the pictures before this one; this one is being measured' : undefined;
    return (
        <span class="quality-error" style={{ opacity: opacityOf(fresh) }} title={title}>
            ±{percent(bound)}
        </span>
    );
}

function Item({ label, title, children }: { label: string; title: string; children: ComponentChildren }) {
    return (
        <span class={`item item-${label}`} title={title}>
            <span class="item-label">{label}</span>
            <span class="item-value">{children}</span>
        </span>
    );
}
