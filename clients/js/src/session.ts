/** A session with lumend: its scene is edited, its views are looked at, light is measured in it. */
import { Edit } from './edit.js';
import { decodeFrame, Flag, type FrameHeader } from './frame.js';
import type { Answers, Notifications, Params, SensorValue, SessionLimits, ViewMembers } from './messages.js';
import { Canvas, readTile, type Picture, type Tile } from './picture.js';
import type { FrameStats, Method, Records } from './records.js';
import { ClosedError, Rpc, type JsonObject } from './rpc.js';
import { addressOf, openSocket } from './socket.js';

export interface ConnectOptions {
    /** A name for people. */
    client?: string;
    /** Of a server with many scenes: the id of the project; '': none, for `project.list` and the like. Default: that of the page's URL. */
    project?: string;
    /** What is waited for comes within that time, or fails; what grows better meanwhile has it for each next step. */
    timeoutMs?: number;
}

/** As scene.get tells it with expand: the fields of its type, null where they are left out. Arrays in bulk are counts. */
export type SceneRecord = { [T in keyof Records]: { type: T } & Partial<Records[T]> }[keyof Records];

const TIMEOUT_MS = 60_000;

/** page: as the server prints it. */
export async function connect(page: string, options: ConnectOptions = {}): Promise<Session> {
    const { address, token, project } = addressOf(page);
    const session = new Session(await openSocket(address), options.timeoutMs ?? TIMEOUT_MS);
    try {
        const wanted = options.project ?? project;
        await session.hello({ client: options.client ?? 'javascript', ...(token !== null && { token }), ...(wanted && { project: wanted }) });
    } catch (error) {
        await session.close();
        throw error;
    }
    return session;
}

type Listener<N extends keyof Notifications> = (params: Notifications[N]) => void;

export class Session {
    /** What others know this session by. */
    name = '';
    role: Answers['session.hello']['role'] = 'view';
    saved: Answers['session.hello']['saved'] = 'no';
    limits!: SessionLimits;
    /** Of a server with many scenes; null: none, or the one there is. */
    project: Answers['session.hello']['project'] = null;
    /** The newest revision of the scene that is known. */
    sceneRev = 0;
    private readonly rpc: Rpc;
    private readonly views = new Map<number, View>();
    private readonly sensors = new Map<string, SensorValue>();
    private readonly listeners = new Map<string, Set<(params: never) => void>>();
    /** Looked at again after each message. */
    private readonly waiting = new Set<() => void>();
    private tiles: Promise<void> = Promise.resolve();
    private watching = false;
    /** What was told last of the project that is being opened. */
    private opening: unknown = null;
    private broken: Error | null = null;
    private readonly closed: Promise<void>;

    /** Of connect(). */
    constructor(
        private readonly socket: WebSocket,
        private readonly timeoutMs: number,
    ) {
        this.rpc = new Rpc((text) => socket.send(text), (method, params) => this.notified(method, params));
        socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.received(event.data);
        socket.onerror = null;
        this.closed = new Promise((resolve) => {
            socket.onclose = (event) => {
                this.end(new ClosedError(event.reason || `the connection is closed (${event.code})`));
                resolve();
            };
        });
    }

    async hello(params: Params['session.hello']): Promise<void> {
        const hello = await this.greeted(params);
        this.name = hello.session;
        this.role = hello.role;
        this.saved = hello.saved;
        this.project = hello.project;
        this.limits = hello.limits;
        this.sceneRev = Math.max(this.sceneRev, hello.scene_rev ?? 0);
    }

    /** The time begins anew whenever the server tells that it is opening the project. */
    private async greeted(params: Params['session.hello']): Promise<Answers['session.hello']> {
        const asked = this.rpc.call('session.hello', params as JsonObject) as Promise<unknown> as Promise<Answers['session.hello']>;
        let settled: true | null = null;
        const look = (): void => {
            settled = true;
            this.news();
        };
        asked.then(look, look);
        await this.wait(() => settled, 'no answer to session.hello', () => this.opening);
        return asked;
    }

    /** Ends the session: the server forgets it. */
    async close(): Promise<void> {
        this.end(new ClosedError('the session was closed'));
        this.socket.close(1000);
        await this.closed;
    }

    // ---- messages ----

    /** Any request of PROTOCOL.md. Fails with RpcError where the server refuses, with ClosedError where it is gone. */
    call<M extends Method>(method: M, params: Params[M], timeoutMs = this.timeoutMs): Promise<Answers[M]> {
        const answer = this.rpc.call(method, params as JsonObject) as Promise<unknown> as Promise<Answers[M]>;
        return within(answer, timeoutMs, `no answer to ${method}`);
    }

    /** A request without an answer: for view.update while something is dragged. */
    notify<M extends Method>(method: M, params: Params[M]): void {
        this.rpc.notify(method, params as JsonObject);
    }

    /** Calls the listener at each such notification, until what this gives back is called. */
    on<N extends keyof Notifications>(notification: N, listener: Listener<N>): () => void {
        const all = this.listeners.get(notification) ?? new Set();
        this.listeners.set(notification, all.add(listener));
        return () => void all.delete(listener);
    }

    private received(data: string | ArrayBuffer): void {
        try {
            if (typeof data === 'string') this.rpc.receive(data);
            else this.receivedTile(data);
        } catch (error) {
            this.fail(error);
        }
        this.news();
    }

    /** Tiles are unpacked one after the other, whatever comes between. */
    private receivedTile(data: ArrayBuffer): void {
        const tile = readTile(decodeFrame(data));
        tile.catch(() => undefined); // it is looked at below, later
        this.tiles = this.tiles
            .then(async () => this.show(await tile))
            .catch((error: unknown) => this.fail(error))
            .then(() => this.news());
    }

    private show(tile: Tile | null): void {
        if (!tile || this.broken) return;
        const { viewId, frameSeq } = tile.header;
        if (this.viewOf(viewId).take(tile)) this.rpc.notify('frame.ack', { view_id: viewId, frame_seq: frameSeq });
    }

    /** Frames of a view may come before the answer that tells its number. */
    private viewOf(id: number): View {
        const view = this.views.get(id) ?? new View(this, id);
        this.views.set(id, view);
        return view;
    }

    private notified(method: string, params: JsonObject): void {
        const told = { method, params } as unknown as { [N in keyof Notifications]: { method: N; params: Notifications[N] } }[keyof Notifications];
        if (told.method === 'scene.changed') this.sceneRev = Math.max(this.sceneRev, told.params.scene_rev);
        else if (told.method === 'project.opening') this.opening = told.params;
        else if (told.method === 'sensors') told.params.sensors.forEach((s) => this.sensors.set(s.id, s));
        else if (told.method === 'frame.stats') this.viewOf(told.params.view_id).told(told.params);
        this.listeners.get(method)?.forEach((listener) => listener(params as never));
    }

    /** What is no message of lumend's: nothing after it can be trusted. */
    private fail(error: unknown): void {
        this.end(new ClosedError(`what came cannot be read: ${error instanceof Error ? error.message : String(error)}`));
        this.socket.close(1000);
    }

    private end(why: Error): void {
        this.broken ??= why;
        this.rpc.close();
        this.news();
    }

    private news(): void {
        for (const look of [...this.waiting]) look();
    }

    /** What `ready` gives once that is not null. The time begins anew whenever `progress` gives another object. */
    async wait<T>(ready: () => T | null, what: string, progress: () => unknown, timeoutMs = this.timeoutMs): Promise<T> {
        for (;;) {
            const found = ready();
            if (found !== null) return found;
            if (this.broken) throw this.broken;
            const before = progress();
            let look = (): void => undefined;
            const step = new Promise<void>((resolve) => {
                look = () => {
                    if (this.broken || ready() !== null || progress() !== before) resolve();
                };
                this.waiting.add(look);
            });
            await within(step, timeoutMs, what).finally(() => this.waiting.delete(look));
        }
    }

    // ---- the scene ----

    /** Every record as it is now, by id. */
    async scene(): Promise<Map<string, SceneRecord>> {
        const { ops } = await this.call('scene.get', { expand: true });
        return new Map(ops.map((op) => [op.id as string, recordOf(op)]));
    }

    /** The ops that rebuild the scene from nothing: one a line they are a scene file, after its header. */
    async ops(): Promise<readonly JsonObject[]> {
        return (await this.call('scene.get', { expand: false })).ops;
    }

    /** await session.edit((edit) => edit.set('key', { flux_lm: 400 })): one transaction. Its revision of the scene. */
    edit(make: (edit: Edit) => void, members: Omit<Params['scene.apply'], 'ops'> = {}): Promise<number> {
        const edit = new Edit();
        make(edit);
        return this.apply(edit.ops, members);
    }

    async apply(ops: readonly JsonObject[], members: Omit<Params['scene.apply'], 'ops'> = {}): Promise<number> {
        return this.revOf(await this.call('scene.apply', { ops, ...members }));
    }

    async undo(): Promise<number> {
        return this.revOf(await this.call('scene.undo', {}));
    }

    async redo(): Promise<number> {
        return this.revOf(await this.call('scene.redo', {}));
    }

    private revOf({ scene_rev: rev }: { scene_rev: number }): number {
        this.sceneRev = Math.max(this.sceneRev, rev);
        return rev;
    }

    // ---- light ----

    /** A view, rendered until it is closed. linear: its pixels are in cd/m2. */
    async view(width: number, height: number, members: Omit<ViewMembers, 'size' | 'codec'> & { linear?: boolean } = {}): Promise<View> {
        const { linear = false, ...rest } = members;
        const codec = linear ? 'half_deflate' : 'rgba8';
        return this.viewOf((await this.call('view.open', { ...rest, size: [width, height], codec })).view_id);
    }

    /** Of View.close(). */
    forget(viewId: number): void {
        this.views.delete(viewId);
    }

    /** What a sensor says of the scene as it is, as soon as that is `enough`; when nothing else is said: as exact as it gets. */
    async sensor(id: string, enough: (value: SensorValue) => boolean = ({ settled }) => settled): Promise<SensorValue> {
        await this.call('sensor.read', { id }); // refused where there is none
        const rev = this.sceneRev;
        if (!this.watching) await this.call('sensor.watch', { on: true, points: true });
        this.watching = true;
        const known = (): SensorValue | null => {
            const value = this.sensors.get(id);
            return value && value.scene_rev >= rev && (value.settled || enough(value)) ? value : null;
        };
        return this.wait(known, `sensor ${id} was not measured`, () => this.sensors.get(id));
    }
}

function recordOf({ op, id, ...fields }: JsonObject): SceneRecord {
    if (op === 'set') return { type: id, ...(fields.value as JsonObject) } as unknown as SceneRecord; // the settings are always there
    return { ...(op === 'import' && { type: op }), ...fields } as unknown as SceneRecord;
}

async function within<T>(promise: Promise<T>, timeoutMs: number, what: string): Promise<T> {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const late = new Promise<never>((_, reject) => {
        timer = setTimeout(() => reject(new Error(`${what} within ${timeoutMs / 1000} s`)), timeoutMs);
    });
    return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/** Of Session.view(). */
export class View {
    private readonly canvas = new Canvas();
    private readonly stats = new Map<number, FrameStats>();
    private cameraSeq = 0;
    private last: FrameHeader | null = null;

    constructor(
        private readonly session: Session,
        readonly id: number,
    ) {}

    /** True: a frame is whole. */
    take(tile: Tile): boolean {
        if (!this.canvas.take(tile)) return false;
        this.last = tile.header;
        for (const seq of this.stats.keys()) if (seq < tile.header.frameSeq) this.stats.delete(seq);
        return true;
    }

    told(stats: FrameStats): void {
        this.stats.set(stats.frame_seq, stats);
    }

    /**
     * The picture of the scene as it is, and of what update() asked for. converged: nothing more will come; else the first
     * whole one, which may be rough (stats.spp 0).
     */
    picture(converged = true): Promise<Picture> {
        const rev = this.session.sceneRev, { cameraSeq } = this;
        const shown = (): Picture | null => {
            const { last } = this;
            if (!last || last.sceneRev < rev || last.cameraSeq < cameraSeq || (converged && !(last.flags & Flag.converged))) return null;
            return this.canvas.picture(this.stats.get(last.frameSeq) ?? null);
        };
        return this.session.wait(shown, `view ${this.id} got no such picture`, () => this.last);
    }

    async update(members: Omit<ViewMembers, 'codec' | 'camera_seq'>): Promise<void> {
        await this.session.call('view.update', { ...members, view_id: this.id, camera_seq: ++this.cameraSeq });
    }

    /** What the picture has there: `value` in `unit`, cd/m2 or lx, and its `error`, each null where it is not known. */
    read(x: number, y: number): Promise<Answers['view.read']> {
        return this.session.call('view.read', { view_id: this.id, x, y });
    }

    /** What is under a pixel; `id` null: nothing. */
    pick(x: number, y: number): Promise<Answers['pick']> {
        return this.session.call('pick', { view_id: this.id, x, y });
    }

    async close(): Promise<void> {
        await this.session.call('view.close', { view_id: this.id });
        this.session.forget(this.id);
    }
}
