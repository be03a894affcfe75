/** The client without its looks: owns the connection, the scene, the view and what the user has selected. */
import { computed, effect, signal } from '@preact/signals';
import { Connection, type ConnectionState } from '../protocol/connection';
import { Codec, decodeFrame, type FrameHeader } from '../protocol/frame';
import { ClosedError, isObject, type Json, type JsonObject, type Rpc } from '../protocol/rpc';
import { numberOr, stringOr, type Pick, type SceneRecord } from '../protocol/types';
import type { Vec3 } from '../lib/vec';
import { orbitFromPose, poseFromOrbit, retarget } from '../view/camera';
import { Picture } from '../view/picture';
import { PASSED_OVER, SILENT, readsVp9 } from '../view/reads';
import { Comeback } from './comeback';
import { Compare, type PictureFacts, type Shot, type Side } from './compare';
import { Convergence } from './convergence';
import { shiningSky, type Daylight } from './daylight';
import { Desk, deskOf } from './desk';
import { Downloads, saveAs } from './downloads';
import { Edits } from './edits';
import { Follower } from './follow';
import { Imports } from './imports';
import { Lamps } from './lamps';
import { Library } from './library';
import { adaptedKelvin, isLamp, isOn } from './lights';
import { factsOf, type Facts } from './luminaires';
import { isSoloed } from './many';
import { LuxMeter } from './luxmeter';
import { Materials } from './materials';
import { Reader } from './readout';
import { may, NOT_IN_THE_PAST, NOT_TO_EDIT, roleOf, type Role } from './role';
import { Reference, type Wanted } from './reference';
import { FrameMeter } from './frame_meter';
import { Framing } from './framing';
import { methodsIn, type Method } from './methods';
import { Mover } from './mover';
import { People } from './people';
import { pickAt } from './pick';
import { Presets } from './presets';
import { hrefOf, Projects } from './projects';
import { SceneMirror } from './scene';
import { Selection } from './selection';
import { Sensors } from './sensors';
import { Sharing } from './sharing';
import { Snap } from './snap';
import { Stills } from './stills';
import { Surroundings } from './surroundings';
import { Toasts } from './toasts';
import { keepToken } from './token';
import { putByHttp, skyOps, Uploads } from './uploads';
import { isOfLight, poseOf, ViewLink } from './view';

/** A lit room in the evening; shown until the server has said what its automatic exposure is. */
const MIDDLE_EV = 8;

/** Tiles that cannot be shown are asked for again, so often in a row; then it is said, and the picture goes on as it is. */
const MAX_RESENDS = 3;
const RESEND_PAUSE_MS = 500;
const TICK_MS = 400;

export class App {
    readonly connection = signal<ConnectionState>({ at: 'connecting' });
    readonly methods = signal<readonly Method[]>([]);
    /** Of whose token this is. */
    readonly role = signal<Role>('edit');
    /** And not while an earlier moment is shown: what is changed would not be seen. */
    readonly mayEdit = computed(() => may(this.role.value, 'edit') && this.view.settings.value.moment === null);
    readonly whyNot = computed(() => (may(this.role.value, 'edit') ? NOT_IN_THE_PAST : NOT_TO_EDIT));
    readonly mayMeasure = computed(() => may(this.role.value, 'measure'));
    /** The server keeps the scene on disk: an edit that it answered outlives it. */
    readonly kept = signal(false);
    /** Connected, and nothing has been heard for some seconds. */
    readonly stalled = signal(false);
    readonly online = computed(() => this.connection.value.at === 'online' && !this.stalled.value);
    /** What somebody else just changed; count tells one such edit from the next. */
    readonly touchedByOthers = signal<{ ids: ReadonlySet<string>; count: number }>({ ids: new Set(), count: 0 });
    readonly helpOpen = signal(false);
    readonly pastOpen = signal(false);
    /** Counts changes of the scene, and of names of its moments. */
    readonly pastChanged = signal(0);
    readonly call: (method: string, params: JsonObject) => Promise<JsonObject>;
    /** Draw lamp markers over the picture. */
    readonly markers = signal(true);
    readonly scene = new SceneMirror();
    readonly meter = new FrameMeter();
    readonly convergence = new Convergence();
    readonly toasts = new Toasts();
    readonly comeback = new Comeback((text) => this.toasts.info(text));
    readonly edits: Edits;
    readonly lux: LuxMeter;
    readonly lamps: Lamps;
    readonly snap = new Snap();
    readonly selection: Selection;
    readonly mover: Mover;
    readonly materials: Materials;
    readonly imports: Imports;
    readonly uploads: Uploads;
    readonly sensors: Sensors;
    readonly downloads: Downloads;
    readonly stills: Stills;
    readonly desk: Desk;
    readonly presets: Presets;
    readonly library: Library;
    readonly reader: Reader;
    readonly compare: Compare;
    readonly reference: Reference;
    /** A moment of the past, beside now. */
    readonly then: Reference;
    readonly projects: Projects;
    readonly sharing: Sharing;
    readonly people: People;
    readonly framing: Framing;
    readonly surroundings: Surroundings;
    readonly view: ViewLink;
    /** What the picture is exposed for: this view's choice, else the scene's; ev is measured by the server when automatic. */
    readonly exposure = computed(() => {
        const chosen = this.view.settings.value.exposure;
        const scene = this.scene.record('render')?.exposure_ev;
        const measured = this.meter.server.value?.exposureEv ?? MIDDLE_EV;
        if (chosen) return chosen.auto ? { auto: true, ev: measured } : chosen;
        return typeof scene === 'number' ? { auto: false, ev: scene } : { auto: true, ev: measured };
    });
    /** What an environment that is on makes way for; null: nothing. */
    readonly shiningSky = computed(() => shiningSky(this.lights()));
    /** Of this view: its own choice, else the scene's. */
    readonly method = computed(() => {
        const name = this.view.settings.value.method ?? this.scene.record('render')?.method;
        return this.methods.value.find((m) => m.name === name);
    });
    /** Of the picture on screen; null: there is none. */
    readonly facts = computed<PictureFacts | null>(() => {
        const frame = this.meter.frame.value;
        const { overlay: map, solo } = this.view.settings.value;
        const method = this.meter.server.value?.method ?? '';
        const { sceneRev: rev, spp, error: bound } = frame ?? { sceneRev: 0, spp: 0, error: null };
        return frame && { rev, method, spp, bound, ev: this.exposure.value.ev, map, solo, pose: this.view.shownPose.value };
    });
    private readonly link: Connection;
    private canvas: HTMLCanvasElement | null = null;
    private user = '';
    private rpc: Rpc | null = null;
    private picture: Picture | null = null;
    private acked = { seq: 0, arrivedAt: 0 };
    private cameraChosen = false;
    /** No lamp shone yet since the view opened. */
    private adapts = false;
    private awaitedEdit: { rev: number; sentAt: number } | null = null;
    /** Shapes are shown because there is no light. */
    private shaped = false;
    /** Frames in a row that could not be shown. */
    private broken = 0;
    private brokenVideo = 0;
    private readonly follower: Follower;

    constructor(url: string, token: string | null, project = '') {
        const call = (method: string, params: JsonObject): Promise<JsonObject> =>
            this.rpc ? this.rpc.call(method, params) : Promise.reject(new ClosedError('not connected'));
        this.call = call;
        const onError = (error: Error): void => this.report(error);
        this.follower = new Follower(this.scene, () => call('scene.get', { expand: true }));
        this.edits = new Edits(this.scene, { call, onError, onAccepted: (rev, at) => this.accepted(rev, at), mayEdit: () => this.editsAllowed(), onStep: () => this.compare.changing() });
        this.view = new ViewLink(call, onError, () => this.method.value?.addsSamples ?? false);
        const { scene, edits, toasts, view } = this;
        this.framing = new Framing({ view, call, onError, cameras: () => scene.list('camera').value, goToCamera: (id) => this.goToCamera(id) });
        this.surroundings = new Surroundings({ call, viewId: () => view.viewId, pose: view.shownPose });
        this.lux = new LuxMeter({
            ...{ scene, call, onError, busy: edits.busy, solo: computed(() => view.settings.value.solo) },
            online: computed(() => this.online.value && this.mayMeasure.value),
            viewId: () => view.viewId,
            viewUnsent: () => view.isDirty(),
        });
        const picked = (): ReturnType<App['picked']> => this.picked();
        const pick = (x: number, y: number): Promise<Pick | null> => this.pick(x, y);
        this.lamps = new Lamps({ scene, edits, view, toasts, call, onError, picked, pick, ev: () => this.exposure.value.ev });
        this.selection = new Selection({ scene, edits, view, toasts, lamps: this.lamps, call, onError });
        this.mover = new Mover({ scene, edits, toasts, snap: this.snap, with: (id) => this.selection.with(id) });
        this.materials = new Materials({ scene, edits, toasts });
        this.imports = new Imports({ scene, edits, toasts, lookAt: (id) => void this.framing.record(id), moveTo: (pose) => view.moveTo(orbitFromPose(pose)) });
        this.library = new Library({ call, pick, online: this.online, place: (...of) => this.lamps.place(...of) });
        this.uploads = new Uploads({
            ...{ imports: this.imports, call, put: putByHttp },
            hang: (asset) => this.library.load().then(() => this.library.place(asset, null)),
            surround: (asset) => edits.attempt(skyOps(asset, this.lights(), (id) => scene.peek(id) !== undefined)),
        });
        this.sensors = new Sensors({ scene, edits, pose: () => poseFromOrbit(view.orbit.value), call, onError });
        this.downloads = new Downloads({ scene, sensors: this.sensors, toasts, online: this.online, viewId: () => view.viewId, call, onError });
        this.stills = new Stills({
            ...{ call, onError, online: this.online, save: saveAs, announce: (text) => toasts.announce(text) },
            ...{ method: () => view.settings.value.method, addsSamples: () => this.method.value?.addsSamples ?? false },
            ...{ pose: () => poseFromOrbit(view.orbit.value), params: () => this.wantedReference().params, restSize: () => view.restSize },
            notify: (method, params) => this.rpc?.notify(method, params),
            canvas: () => document.createElement('canvas'),
        });
        this.presets = new Presets({ scene, edits, announce: (text) => toasts.announce(text) });
        this.desk = new Desk({ scene, edits, call });
        this.reader = new Reader({
            ...{ call, online: this.online, frame: this.meter.frame },
            wanted: computed(() => isOfLight(view.settings.value.overlay)),
            map: computed(() => view.settings.value.overlay),
            viewId: () => view.viewId,
            size: () => view.size.peek(),
        });
        this.compare = new Compare({ now: () => this.shotOf('now'), announce: (text) => toasts.announce(text) });
        this.reference = new Reference({
            ...{ call, onError, wanted: this.compare.wantsReference, canvas: () => document.createElement('canvas') },
            notify: (method, params) => this.rpc?.notify(method, params),
            onRefused: (error) => this.noReference(error),
            what: computed(() => this.wantedReference()),
        });
        this.then = new Reference({
            ...{ call, onError, wanted: this.compare.wantsMoment, canvas: () => document.createElement('canvas') },
            ...{ kind: 'moment', method: () => view.settings.value.method ?? '' },
            notify: (method, params) => this.rpc?.notify(method, params),
            onRefused: (error) => this.noReference(error),
            what: computed(() => this.wantedReference(this.compare.moment.value?.rev)),
        });
        this.projects = new Projects({ call, onError, announce: (text) => toasts.announce(text), goTo: (id) => location.assign(hrefOf(id)) });
        this.sharing = new Sharing({
            ...{ pose: () => poseFromOrbit(view.orbit.value), settings: () => view.settings.value, project: () => this.projects.here.value?.id ?? '' },
            known: () => ({ methods: this.methods.value.map((m) => m.name), effects: this.methods.value.flatMap((m) => m.effects) }),
            show: (pose, settings) => ((this.adapts = false), view.show(pose, settings)),
            ...{ onRefused: (text) => toasts.info(text), announce: (text) => toasts.announce(text) },
        });
        const pose = computed(() => poseFromOrbit(view.orbit.value));
        this.people = new People({ call, pose, pick: (x, y) => this.look(x, y), online: this.online, announce: (text) => toasts.announce(text) });
        this.link = new Connection(url, token, {
            onState: (state) => this.stateChanged(state),
            onOnline: (rpc, hello) => void this.cameOnline(rpc, hello),
            sceneRev: () => this.follower.knownRev,
            onNotification: (method, params) => this.notified(method, params),
            onBinary: (message) => this.binary(message),
            onBeat: () => void this.ping(),
            onStalled: (stalled) => this.stall(stalled),
            onTurnedAway: (reason) => (this.projects.problem.value = reason),
        }, project);
        // Where nothing shines yet shapes show what the first lamp can hang on.
        effect(() => {
            const empty = this.scene.lamps.value.length === 0;
            const { overlay } = this.view.settings.value;
            if (empty && !this.shaped && overlay === 'none' && this.meter.server.value?.inView === 'dark') {
                this.shaped = true;
                this.view.change({ overlay: 'shapes' });
            } else if (!empty && this.shaped) {
                this.shaped = false;
                if (overlay === 'shapes') this.view.change({ overlay: 'none' });
            }
        });
        // What does not exist any more cannot shine alone.
        effect(() => {
            const { lamps, rev } = this.scene;
            const { solo } = this.view.settings.value;
            if (rev.value === 0 || solo.length === 0) return;
            if (!lamps.value.some((id) => this.isSoloed(id))) this.view.change({ solo: [] });
        });
    }

    private lamped(): SceneRecord[] {
        return this.scene.lamps.value.map((id) => this.scene.record(id)).filter((l) => l !== undefined);
    }

    /** Once: lamps that change their colour are seen to. Where none shines yet, the first that does is what the eye comes to. */
    private adapt(): void {
        const lit = this.lamped().some(isOn);
        this.adapts = !lit;
        if (lit) this.view.change({ whiteBalance: adaptedKelvin(this.lamped()) });
    }

    chooseWhite(whiteBalance: number | null): void {
        this.adapts = false;
        this.view.change({ whiteBalance });
    }

    private lights(): SceneRecord[] {
        return this.scene.list('light').value.map((id) => this.scene.record(id)).filter((l) => l !== undefined);
    }

    start(canvas: HTMLCanvasElement): void {
        this.canvas = canvas;
        this.picture = new Picture(canvas, {
            onDrawn: (last, arrivedAt) => this.drawn(last, arrivedAt),
            onBroken: (last, arrivedAt, error) => this.broke(last, arrivedAt, error),
            onUnreadable: (codec) => codec === Codec.webp && this.view.reads('webp', false),
        });
        void readsVp9().then((does) => this.view.reads('vp9', does));
        this.link.connect();
        setInterval(() => this.meter.tick(), TICK_MS);
        document.addEventListener('visibilitychange', () => void this.ping());
    }

    useToken(token: string): void {
        keepToken(token);
        this.link.setToken(token);
    }

    retryNow(): void {
        this.link.connect();
    }

    /** Its address ends in this now: a view to be shown. */
    calledFor(hash: string): void {
        if (this.sharing.called(hash) && this.online.value && this.methods.value.length > 0) this.sharing.apply();
    }

    /* ---- what the user does with the picture ---- */

    private async look(x: number, y: number): Promise<Pick | null> {
        return this.rpc && pickAt((...of) => this.rpc!.call(...of), { viewId: this.view.viewId, size: this.view.size.value }, x, y);
    }

    async pick(x: number, y: number): Promise<Pick | null> {
        return this.look(x, y).catch((error: unknown) => (this.report(error as Error), null));
    }

    /** Where the pointer is, in fractions of the picture; null: elsewhere. */
    pointAt(place: readonly [number, number] | null): void {
        this.reader.pointAt(place);
        this.people.pointAt(place);
    }

    /** A click: what is there, and how much light falls on it. While a lamp is aimed, that is where it points. */
    async inspect(x: number, y: number): Promise<void> {
        const pick = await this.pick(x, y);
        if (this.lamps.aiming.value) {
            if (pick) this.lamps.pointAt(pick.point);
            else this.toasts.announce('Nothing is there to point at');
            return;
        }
        if (!pick) {
            this.lux.hide();
            this.toasts.announce('Nothing is there');
            return;
        }
        this.toasts.announce(`${pick.id}, ${pick.distance.toFixed(2)} metres away`);
        const record = this.scene.peek(pick.id);
        if (isLamp(record)) this.lamps.selected.value = pick.id;
        this.materials.pick(record);
        const model = this.imports.importOf(record);
        this.imports.selected.value = model;
        this.lux.show(pick, model ?? (record?.type === 'object' ? record.id : null));
    }

    /** What the user picked, where it is by now. */
    picked(): { pick: Pick; point: Vec3 } | null {
        const reading = this.lux.reading.value;
        return reading && { pick: reading.pick, point: this.lux.point(reading) };
    }

    /** A click with Ctrl or Shift: a lamp, an object or a model joins those that are selected, or leaves them. */
    async addToSelection(x: number, y: number): Promise<void> {
        const pick = await this.pick(x, y);
        const record = pick ? this.scene.peek(pick.id) : undefined;
        if (record) this.selection.toggle(isLamp(record) ? record.id : (this.imports.importOf(record) ?? record.id));
        else this.toasts.announce('Nothing is there');
    }

    async undo(): Promise<void> {
        if (await this.edits.undo()) this.toasts.announce('Undone');
    }

    async redo(): Promise<void> {
        if (await this.edits.redo()) this.toasts.announce('Done again');
    }

    /** A double click: turn about that point from now on. */
    async lookAt(x: number, y: number): Promise<void> {
        const pick = await this.pick(x, y);
        if (pick) this.view.moveTo(retarget(this.view.orbit.value, pick.point));
    }

    /** Where the sun stands, and the lux of sun and sky; null: nobody says. */
    async daylight(): Promise<Daylight | null> {
        return this.rpc ? ((await this.rpc.call('daylight').catch(() => null)) as unknown as Daylight | null) : null;
    }

    /** What the file of a lamp says; null: nobody tells. */
    async photometryOf(id: string): Promise<Facts | null> {
        const told = await this.rpc?.call('photometry', { id }).catch(() => null);
        return told ? factsOf(told) : null;
    }

    /** A lamp, a model, a picked point, or else the whole scene as its camera shows it. */
    frameSelection(): void {
        const { lamps, imports, framing } = this;
        const picked = this.picked();
        if (lamps.selected.value && framing.lamp(this.scene.peek(lamps.selected.value))) return;
        if (imports.selected.value) void framing.record(imports.selected.value);
        else if (picked) framing.point(picked.point);
        else this.goHome();
    }

    goHome(): void {
        const cameras = this.scene.list('camera').value;
        const wanted = [stringOr(this.scene.peek('render')?.camera, ''), 'main'];
        this.goToCamera(wanted.find((id) => cameras.includes(id)) ?? cameras[0] ?? '');
    }

    goToCamera(id: string): void {
        this.view.moveTo(orbitFromPose(poseOf(this.scene.peek(id))));
    }

    /** name: of a lamp, or of a group of them. In this view alone; the others see all. */
    toggleSolo(name: string): void {
        const on = this.view.settings.value.solo.includes(name);
        this.view.change({ solo: on ? [] : [name] });
        this.toasts.announce(on ? 'All lamps that are on shine again' : `Only ${name} shines, in your view alone`);
    }

    /** By itself, or with its group. */
    isSoloed(id: string): boolean {
        const lamp = this.scene.record(id);
        return lamp !== undefined && isSoloed(lamp, this.view.settings.value.solo);
    }

    /** It is on, and others are shown alone. */
    isHidden(id: string): boolean {
        return this.view.settings.value.solo.length > 0 && !this.isSoloed(id);
    }

    /** Ends the aiming; else selects nothing. */
    clearSelection(): void {
        if (this.lamps.aiming.value) {
            this.lamps.aiming.value = null;
            return;
        }
        this.lux.hide();
        this.selection.clear();
        this.materials.pick(undefined);
        this.imports.selected.value = null;
    }

    /** Says why where they are not: by key, and by hand in the picture, everything can be tried. */
    private editsAllowed(): boolean {
        const why = this.whyNot.value;
        if (!this.mayEdit.value && !this.toasts.shown.value.some((t) => t.text === why)) this.toasts.info(why);
        return this.mayEdit.value;
    }

    /** What a side of the wipe shows; null: nothing yet. */
    shotOf(side: Side): Shot | null {
        if (side === 'reference') return this.reference.shot.value;
        if (side === 'moment') return this.then.shot.value;
        if (side !== 'now') return this.compare.shotOf(side);
        const { canvas } = this;
        return canvas && this.facts.value && { name: 'Now', facts: this.facts.value, canvas };
    }

    private wantedReference(moment?: number): Wanted {
        const { overlay, solo } = this.view.settings.value;
        const { ev } = this.exposure.value;
        const scale = isOfLight(overlay) ? (this.meter.server.value?.legend?.scale ?? null) : null;
        const map = isOfLight(overlay) ? overlay : 'none';
        return { pose: poseFromOrbit(this.view.orbit.value), params: { ...this.view.likeParams(ev, scale), ...(moment === undefined ? {} : { moment }) }, facts: { ev, map, solo } };
    }

    private noReference(error: Error): void {
        this.report(error);
        if (!(error instanceof ClosedError)) this.compare.close();
    }

    /* ---- connection ---- */

    private stateChanged(state: ConnectionState): void {
        const before = this.connection.value.at;
        this.connection.value = state;
        if (state.at === 'online') this.toasts.announce('Connected');
        if (before === 'online' && state.at !== 'online') {
            this.rpc = null;
            this.comeback.connectionLost();
            this.stalled.value = false;
            this.meter.roundTripMs.value = null;
            this.edits.drop();
            this.view.closed();
            for (const part of [this.reference, this.then, this.sensors, this.presets, this.stills, this.people]) part.closed();
            this.convergence.reset();
            this.awaitedEdit = null;
            this.toasts.announce('Connection lost');
        }
    }

    private stall(stalled: boolean): void {
        this.stalled.value = stalled;
        if (stalled) this.meter.roundTripMs.value = null;
        this.toasts.announce(stalled ? 'The server does not answer' : 'The server answers again');
    }

    private async cameOnline(rpc: Rpc, hello: JsonObject): Promise<void> {
        this.rpc = rpc;
        this.user = stringOr(hello.session, '');
        this.imports.offered.value = hello.imports !== false;
        this.uploads.offered.value = hello.uploads === true;
        this.role.value = roleOf(hello.role);
        this.kept.value = hello.saved === 'commit' || hello.saved === 'interval';
        this.picture?.reset();
        if (this.projects.online(hello)) return;
        const follows = this.comeback.online(hello, !this.cameraChosen);
        try {
            if (hello.resumed === true) void this.edits.repeat(); /* before anything newer is sent */
            if (!follows) await this.follower.begin();
            this.forgetGone();
            if (this.mayMeasure.value) this.sensors.begin();
            if (hello.resumed !== true) this.tellLost();
            if (this.sharing.waits) await this.learn(rpc);
            if (!this.sharing.apply() && !this.cameraChosen) {
                this.goHome();
                this.adapt();
            }
            this.cameraChosen = true;
            this.pastChanged.value++;
            await this.view.open();
            this.surroundings.again();
            void this.people.begin(this.user);
            this.reference.begin();
            this.then.begin();
            await this.learn(rpc);
            this.sharing.apply(); // a link that came since
        } catch (error) {
            this.report(error as Error);
        }
    }

    /** What the server has. */
    private async learn(rpc: Rpc): Promise<void> {
        const stats = await rpc.call('stats.get');
        this.methods.value = methodsIn(stats.methods);
        this.desk.status.value = deskOf(stats);
    }

    private tellLost(): void {
        const n = this.edits.missing();
        if (n === 0) return;
        const what = n === 1 ? 'One change was' : `${n} changes were`;
        this.toasts.info(`${what} lost when the connection broke`, [
            { label: 'Send again', run: () => void this.edits.resend() },
            { label: 'Forget', run: () => this.edits.forgetLost() },
        ]);
    }

    private async follow(changed: JsonObject): Promise<void> {
        try {
            await this.follower.follow(changed);
            this.forgetGone();
            this.surroundings.again();
            if (this.adapts) this.adapt();
        } catch (error) {
            this.report(error as Error);
        }
    }

    private forgetGone(): void {
        this.lamps.forgetIfGone();
        this.selection.forgetIfGone();
        this.materials.forgetIfGone();
        this.imports.forgetIfGone();
    }

    private notified(method: string, params: JsonObject): void {
        if (method === 'scene.changed') {
            this.edits.arrived(stringOr(params.op_id, ''));
            this.comeback.changed(params, params.user === this.user);
            void this.follow(params);
            this.pastChanged.value++;
            if (params.user !== this.user) this.othersEdited(params.ops);
        } else if (method === 'frame.stats' && this.view.owns(numberOr(params.view_id, 0), numberOr(params.camera_seq, 0))) {
            this.meter.stats(params);
            this.convergence.stats(params, performance.now());
        } else if (method === 'timeline.named') {
            this.pastChanged.value++;
        } else if (method === 'preset.fading') {
            this.presets.notified(params);
        } else if (method === 'report.progress') {
            this.downloads.notified(params);
        } else if (method === 'presence') {
            this.people.notified(params);
        } else if (method === 'sensors') {
            this.sensors.notified(params);
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
            const { viewId, cameraSeq } = frame.header;
            for (const view of [this.reference, this.then, this.stills]) if (view.owns(viewId, cameraSeq)) view.receive(frame);
            if (this.view.owns(viewId, cameraSeq)) this.picture?.receive(frame);
        } catch (error) {
            this.report(error as Error);
        }
    }

    /** A whole frame is on the canvas. In a hidden tab, where nobody looks, the next one is asked for by the ping alone. */
    private drawn(last: FrameHeader, arrivedAt: number): void {
        this.broken = 0;
        this.comeback.drawn(this.view.settings.value.moment === null ? last.sceneRev : Infinity);
        const cameraLatency = this.view.drawn(last);
        if (cameraLatency !== null) this.meter.latency(cameraLatency);
        if (this.awaitedEdit && last.sceneRev >= this.awaitedEdit.rev) {
            this.meter.latency(performance.now() - this.awaitedEdit.sentAt);
            this.awaitedEdit = null;
        }
        this.meter.drawn(last);
        if (last.codec === Codec.vp9) this.brokenVideo = 0;
        this.acked = { seq: last.frameSeq, arrivedAt };
        if (!document.hidden) this.acknowledge(last, arrivedAt);
    }

    /** The first time it is not acknowledged: it is not on the screen. One that fails again must not stop the picture. */
    private broke(last: FrameHeader, arrivedAt: number, error: Error): void {
        if (error.name === PASSED_OVER) return this.acknowledge(last, arrivedAt);
        if (last.codec === Codec.vp9 && (error.name === SILENT || ++this.brokenVideo > MAX_RESENDS)) this.view.reads('vp9', false);
        this.broken++;
        if (this.broken > 1) this.acknowledge(last, arrivedAt);
        if (this.broken <= MAX_RESENDS) setTimeout(() => this.view.resend(), this.broken > 1 ? RESEND_PAUSE_MS : 0);
        else if (this.broken === MAX_RESENDS + 1) this.report(new Error(`A part of the picture cannot be shown: ${error.message}`));
    }

    /** The time that drawing took is not the line's. */
    private acknowledge(last: FrameHeader, arrivedAt: number): void {
        this.rpc?.notify('frame.ack', { view_id: last.viewId, frame_seq: last.frameSeq, held_ms: performance.now() - arrivedAt });
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
        if (this.projects.shown.value) await this.projects.refresh();
        if (!rpc || viewId === null) return;
        const start = performance.now();
        if (!document.hidden) for (const view of [this.reference, this.then]) view.acknowledge();
        try {
            await rpc.call('frame.ack', { view_id: viewId, frame_seq: this.acked.seq, held_ms: start - this.acked.arrivedAt });
            this.meter.roundTripMs.value = performance.now() - start;
        } catch (error) {
            this.report(error as Error);
        }
    }

    report(error: Error): void {
        if (!(error instanceof ClosedError)) this.toasts.error(error);
    }
}
