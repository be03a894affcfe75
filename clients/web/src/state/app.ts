/** The client without its looks: owns the connection, the scene, the view and what the user has selected. */
import { computed, effect, signal } from '@preact/signals';
import { Connection, type ConnectionState } from '../protocol/connection';
import { decodeFrame, type FrameHeader } from '../protocol/frame';
import { ClosedError, isObject, type Json, type JsonObject, type Rpc } from '../protocol/rpc';
import { numberOr, stringOr, vec3Or, type CameraPose, type Pick, type SceneRecord } from '../protocol/types';
import { add, length, scale, sub, type Vec3 } from '../lib/vec';
import { basis, frameBall, orbitFromPose, poseFromOrbit, retarget } from '../view/camera';
import { Picture } from '../view/picture';
import { Convergence } from './convergence';
import { Edits } from './edits';
import { Imports, newId } from './imports';
import { centreOf, extentOf, isLamp, isPlaced, Solo, UNITS } from './lights';
import { Meter } from './meter';
import { anchorOf, anchoredAt } from './placement';
import { SceneMirror } from './scene';
import { Toasts } from './toasts';
import { keepToken } from './token';
import { DEFAULT_POSE, ViewLink } from './view';

export interface Reading {
    pick: Pick;
    /** What the point lies on and moves with: an object, or the model that it belongs to. offset: from its anchor. */
    carrier: { id: string; offset: Vec3 } | null;
    /** null: still being measured. */
    lux: { value: number; stderr: number } | null;
}

/** A lit room in the evening; shown until the server has said what its automatic exposure is. */
const MIDDLE_EV = 8;
/** Of a lamp that is put in: what its slider reaches. */
const BRIGHTEST_LM = UNITS.flux_lm.max;
export interface Method {
    name: string;
    summary: string;
    /** A picture at rest gets better, and its error is known. */
    addsSamples: boolean;
}

/** The meter says something at once, and more precisely for as long as nothing changes. */
const PROBE_SAMPLES = [512, 4096, 32768];
/** Standard error, relative, below which nobody asks for more. */
const PROBE_PRECISE = 0.005;
/** After an edit the meter waits for the hand to rest: a probe costs rays that the picture wants. */
const PROBE_DELAY_MS = 250;
const PING_MS = 2000;
const TICK_MS = 400;

export class App {
    readonly connection = signal<ConnectionState>({ at: 'connecting' });
    readonly methods = signal<readonly Method[]>([]);
    readonly selectedLight = signal<string | null>(null);
    readonly reading = signal<Reading | null>(null);
    /** What somebody else just changed; count tells one such edit from the next. */
    readonly touchedByOthers = signal<{ ids: ReadonlySet<string>; count: number }>({ ids: new Set(), count: 0 });
    readonly helpOpen = signal(false);
    /** Draw lamp markers over the picture. */
    readonly markers = signal(true);
    readonly scene = new SceneMirror();
    readonly meter = new Meter();
    readonly convergence = new Convergence();
    readonly toasts = new Toasts();
    readonly solo = new Solo();
    readonly edits: Edits;
    readonly imports: Imports;
    readonly view: ViewLink;
    /** What the picture is exposed for: this view's choice, else the scene's; ev is measured by the server when automatic. */
    readonly exposure = computed(() => {
        const chosen = this.view.settings.value.exposure;
        const scene = this.scene.record('render')?.exposure_ev;
        const measured = this.meter.server.value?.exposureEv ?? MIDDLE_EV;
        if (chosen) return chosen.auto ? { auto: true, ev: measured } : chosen;
        return typeof scene === 'number' ? { auto: false, ev: scene } : { auto: true, ev: measured };
    });
    /** Of this view: its own choice, else the scene's. */
    readonly method = computed(() => {
        const name = this.view.settings.value.method ?? this.scene.record('render')?.method;
        return this.methods.value.find((m) => m.name === name);
    });
    private readonly link: Connection;
    private user = '';
    private rpc: Rpc | null = null;
    private picture: Picture | null = null;
    private ackedSeq = 0;
    private cameraChosen = false;
    private awaitedEdit: { rev: number; sentAt: number } | null = null;
    private probeTimer = 0;

    constructor(url: string, token: string | null) {
        const call = (method: string, params: JsonObject): Promise<JsonObject> =>
            this.rpc ? this.rpc.call(method, params) : Promise.reject(new ClosedError('not connected'));
        const onError = (error: Error): void => this.report(error);
        this.edits = new Edits(this.scene, { call, onError, onAccepted: (rev, at) => this.accepted(rev, at) });
        this.view = new ViewLink(call, onError, () => this.method.value?.addsSamples ?? false);
        const { scene, edits, toasts } = this;
        this.imports = new Imports({ scene, edits, toasts, lookAt: (id) => void this.frameRecord(id) });
        this.link = new Connection(url, token, {
            onState: (state) => this.stateChanged(state),
            onOnline: (rpc, hello) => void this.online(rpc, hello),
            onNotification: (method, params) => this.notified(method, params),
            onBinary: (message) => this.binary(message),
        });
        effect(() => {
            if (this.scene.rev.value > 0) this.scheduleProbe();
        });
    }

    start(canvas: HTMLCanvasElement): void {
        this.picture = new Picture(
            canvas,
            (last) => void this.drawn(last),
            (error) => this.report(error),
        );
        this.link.connect();
        setInterval(() => this.meter.tick(), TICK_MS);
        setInterval(() => void this.ping(), PING_MS);
    }

    useToken(token: string): void {
        keepToken(token);
        this.link.setToken(token);
    }

    retryNow(): void {
        this.link.connect();
    }

    /* ---- what the user does with the picture ---- */

    async pick(x: number, y: number): Promise<Pick | null> {
        const [w, h] = this.view.size.value;
        if (this.view.viewId === null || !this.rpc) return null;
        try {
            const hit = await this.rpc.call('pick', { view_id: this.view.viewId, x: x * w, y: y * h });
            if (typeof hit.id !== 'string') return null;
            const point = vec3Or(hit.point, [0, 0, 0]);
            return { id: hit.id, point, normal: vec3Or(hit.normal, [0, 1, 0]), distance: numberOr(hit.distance, 0) };
        } catch (error) {
            this.report(error as Error);
            return null;
        }
    }

    /** A click: what is there, and how much light falls on it. */
    async inspect(x: number, y: number): Promise<void> {
        const pick = await this.pick(x, y);
        this.reading.value = pick && { pick, carrier: this.carrierOf(pick), lux: null };
        if (!pick) return;
        this.toasts.announce(`${pick.id}, ${pick.distance.toFixed(2)} metres away`);
        const record = this.scene.peek(pick.id);
        if (isLamp(record)) this.selectedLight.value = pick.id;
        this.imports.selected.value = this.imports.importOf(record);
        await this.measure();
    }

    /** Where the picked point is by now. */
    pickedPoint({ pick, carrier }: Reading): Vec3 {
        const record = carrier && this.scene.record(carrier.id);
        return record ? add(anchorOf(record), carrier.offset) : pick.point;
    }

    /** Puts the anchor of a lamp, an object or a model there, as a step of a gesture. */
    moveRecord(id: string, anchor: Vec3): void {
        const record = this.scene.peek(id);
        if (!record) return;
        const { path, value } = anchoredAt(record, anchor);
        this.edits.set(id, path, value);
    }

    private carrierOf(pick: Pick): Reading['carrier'] {
        const record = this.scene.peek(pick.id);
        const model = this.imports.importOf(record);
        const carrier = model ? this.scene.peek(model) : record?.type === 'object' ? record : undefined;
        return carrier ? { id: carrier.id, offset: sub(pick.point, anchorOf(carrier)) } : null;
    }

    /** A double click: turn about that point from now on. */
    async lookAt(x: number, y: number): Promise<void> {
        const pick = await this.pick(x, y);
        if (pick) this.view.moveTo(retarget(this.view.orbit.value, pick.point));
    }

    /** An object, or all that an import brought: as its own camera shows it, for a room is best seen from inside. */
    async frameRecord(id: string): Promise<void> {
        const camera = this.scene.list('camera').value.find((c) => c.startsWith(`${id}/`));
        if (camera) this.goToCamera(camera);
        if (camera || !this.rpc) return;
        try {
            const box = await this.rpc.call('bounds', { id });
            const lo = vec3Or(box.min, [0, 0, 0]);
            const hi = vec3Or(box.max, [0, 0, 0]);
            const radius = Math.max(0.05, length(sub(hi, lo)) / 2);
            this.view.moveTo(frameBall(this.view.orbit.value, scale(add(lo, hi), 0.5), radius, this.view.aspect.value));
        } catch (error) {
            this.report(error as Error);
        }
    }

    /** A lamp, a model, a picked point, or else the whole scene as its camera shows it. */
    frameSelection(): void {
        const aspect = this.view.aspect.value;
        const light = this.selectedLight.value ? this.scene.peek(this.selectedLight.value) : undefined;
        const reading = this.reading.value;
        if (light && isPlaced(light)) {
            this.view.moveTo(frameBall(this.view.orbit.value, centreOf(light), 3 * extentOf(light), aspect));
        } else if (this.imports.selected.value) {
            void this.frameRecord(this.imports.selected.value);
        } else if (reading) {
            const point = this.pickedPoint(reading);
            const distance = length(sub(point, poseFromOrbit(this.view.orbit.value).position));
            this.view.moveTo(frameBall(this.view.orbit.value, point, Math.max(0.05, 0.12 * distance), aspect));
        } else {
            this.goHome();
        }
    }

    goHome(): void {
        const cameras = this.scene.list('camera').value;
        const wanted = [stringOr(this.scene.peek('render')?.camera, ''), 'main'];
        this.goToCamera(wanted.find((id) => cameras.includes(id)) ?? cameras[0] ?? '');
    }

    goToCamera(id: string): void {
        this.view.moveTo(orbitFromPose(poseOf(this.scene.peek(id))));
    }

    /**
     * A bulb between the eye and what it looks at, and above: it lights what is seen, and can be taken from there. EV100 shows
     * 2^EV / 8 cd/m² as middle grey, and half white at r metres from the bulb has flux / (8 π² r²).
     */
    async addLamp(): Promise<void> {
        const { distance } = this.view.orbit.value;
        const pose = poseFromOrbit(this.view.orbit.value);
        const middle = scale(add(pose.position, pose.target), 0.5);
        const above = scale(basis(pose).up, 0.15 * distance);
        const flux = (Math.PI * 0.5 * distance) ** 2 * 2 ** this.exposure.value.ev;
        const id = newId('lamp', (taken) => this.scene.peek(taken) !== undefined);
        const lamp = {
            kind: 'point',
            position: [...add(middle, above)],
            flux_lm: Number(Math.min(flux, BRIGHTEST_LM).toPrecision(2)),
            cct_k: 3000,
        };
        if (await this.edits.transaction([{ op: 'add', type: 'light', id, ...lamp }])) this.selectedLight.value = id;
    }

    /** A lamp, or all of a group. */
    toggleSolo(ids: readonly string[]): void {
        const lights = this.scene.lamps.value.map((l) => this.scene.peek(l));
        const ops = this.solo.toggle(
            ids,
            lights.filter((l) => l !== undefined),
        );
        if (ops.length > 0) void this.edits.transaction(ops);
    }

    clearSelection(): void {
        this.reading.value = null;
        this.selectedLight.value = null;
        this.imports.selected.value = null;
    }

    /* ---- connection ---- */

    private stateChanged(state: ConnectionState): void {
        const before = this.connection.value.at;
        this.connection.value = state;
        if (state.at === 'online') this.toasts.announce('Connected');
        if (before === 'online' && state.at !== 'online') {
            this.rpc = null;
            this.edits.drop();
            this.view.closed();
            this.convergence.reset();
            this.awaitedEdit = null;
            this.toasts.announce('Connection lost');
        }
    }

    private async online(rpc: Rpc, hello: JsonObject): Promise<void> {
        this.rpc = rpc;
        this.user = stringOr(hello.session, '');
        this.imports.offered.value = hello.imports !== false;
        this.picture?.reset();
        try {
            await this.reload();
            if (!this.cameraChosen) this.goHome();
            this.cameraChosen = true;
            await this.view.open();
            void this.ping();
            this.methods.value = methodsIn((await rpc.call('stats.get')).methods);
        } catch (error) {
            this.report(error as Error);
        }
    }

    private async reload(): Promise<void> {
        if (!this.rpc) return;
        const reply = await this.rpc.call('scene.get', { expand: true });
        this.scene.load(reply.ops, numberOr(reply.scene_rev, 0));
        const selected = this.selectedLight.peek();
        if (selected && !this.scene.peek(selected)) this.selectedLight.value = null;
        this.imports.forgetIfGone();
    }

    private notified(method: string, params: JsonObject): void {
        if (method === 'scene.changed') {
            if (!this.scene.apply(params.ops, numberOr(params.scene_rev, 0), params.emits)) {
                void this.reload().catch((error: Error) => this.report(error));
            }
            if (params.user !== this.user) this.othersEdited(params.ops);
        } else if (method === 'frame.stats') {
            this.meter.stats(params);
            this.convergence.stats(params, performance.now());
        } else if (method === 'import.progress') {
            this.imports.progress.value = { stage: stringOr(params.stage, ''), fraction: numberOr(params.fraction, 0) };
        }
    }

    private othersEdited(ops: Json | undefined): void {
        const ids = (Array.isArray(ops) ? ops : []).map((op) => (isObject(op) ? stringOr(op.id, '') : ''));
        this.touchedByOthers.value = { ids: new Set(ids), count: this.touchedByOthers.value.count + 1 };
    }

    private binary(message: ArrayBuffer): void {
        this.meter.received(message.byteLength);
        try {
            const frame = decodeFrame(message);
            if (this.view.owns(frame.header.viewId)) this.picture?.receive(frame);
        } catch (error) {
            this.report(error as Error);
        }
    }

    /** A whole frame is on the canvas. A hidden tab does not ask for the next one: nobody looks. */
    private async drawn(last: FrameHeader): Promise<void> {
        const cameraLatency = this.view.drawn(last);
        if (cameraLatency !== null) this.meter.latency(cameraLatency);
        if (this.awaitedEdit && last.sceneRev >= this.awaitedEdit.rev) {
            this.meter.latency(performance.now() - this.awaitedEdit.sentAt);
            this.awaitedEdit = null;
        }
        this.meter.drawn(last);
        const rpc = this.rpc;
        if (document.hidden) await visible();
        rpc?.notify('frame.ack', { view_id: last.viewId, frame_seq: last.frameSeq });
        this.ackedSeq = last.frameSeq;
    }

    private accepted(rev: number, sentAt: number): void {
        // The frame may have come before the reply.
        const shown = this.meter.frame.value?.sceneRev ?? 0;
        if (shown >= rev) this.meter.latency(performance.now() - sentAt);
        else this.awaitedEdit ??= { rev, sentAt };
    }

    /** A second acknowledgement of the same frame means nothing, and is answered at once, whatever the renderer is doing. */
    private async ping(): Promise<void> {
        const rpc = this.rpc;
        const viewId = this.view.viewId;
        if (!rpc || viewId === null || document.hidden) return;
        const start = performance.now();
        try {
            await rpc.call('frame.ack', { view_id: viewId, frame_seq: this.ackedSeq });
            this.meter.roundTripMs.value = performance.now() - start;
        } catch (error) {
            this.report(error as Error);
        }
    }

    /* ---- light meter ---- */

    private scheduleProbe(): void {
        clearTimeout(this.probeTimer);
        if (!this.reading.peek()) return;
        this.probeTimer = setTimeout(() => void this.measure(), PROBE_DELAY_MS) as unknown as number;
    }

    private async measure(step = 0): Promise<void> {
        const reading = this.reading.peek();
        const timer = this.probeTimer;
        if (!reading || !this.rpc) return;
        try {
            const [point, normal] = [[...this.pickedPoint(reading)], [...reading.pick.normal]];
            const params = { point, normal, samples: PROBE_SAMPLES[step]! };
            const r = await this.rpc.call('probe', params);
            if (this.reading.peek()?.pick !== reading.pick) return;
            const lux = { value: numberOr(r.illuminance_lx, NaN), stderr: numberOr(r.stderr_lx, NaN) };
            this.reading.value = { ...reading, lux };
            if (timer !== this.probeTimer || step + 1 === PROBE_SAMPLES.length || lux.stderr <= PROBE_PRECISE * lux.value) return;
            this.probeTimer = setTimeout(() => void this.measure(step + 1), PROBE_DELAY_MS) as unknown as number;
        } catch (error) {
            this.report(error as Error);
        }
    }

    private report(error: Error): void {
        if (!(error instanceof ClosedError)) this.toasts.error(error);
    }
}

function visible(): Promise<void> {
    return new Promise((resolve) => {
        const check = (): void => {
            if (document.hidden) return;
            document.removeEventListener('visibilitychange', check);
            resolve();
        };
        document.addEventListener('visibilitychange', check);
    });
}

function methodsIn(list: Json | undefined): Method[] {
    const rows = Array.isArray(list) ? list.filter(isObject) : [];
    return rows.map((m) => ({
        name: stringOr(m.name, ''),
        summary: stringOr(m.summary, ''),
        addsSamples: m.progressive === true || m.refines === true,
    }));
}

function poseOf(camera: SceneRecord | undefined): CameraPose {
    if (!camera) return DEFAULT_POSE;
    return {
        position: vec3Or(camera.position, DEFAULT_POSE.position),
        target: vec3Or(camera.target, DEFAULT_POSE.target),
        up: vec3Or(camera.up, DEFAULT_POSE.up),
        vfov_deg: numberOr(camera.vfov_deg, DEFAULT_POSE.vfov_deg),
    };
}
