/** A session with lumend: its scene is edited, its views are looked at, light is measured in it. */
import { Edit } from './edit.js';
import { decodeFrame, Flag, type FrameHeader } from './frame.js';
import type { Answers, Notifications, Params, SensorValue, SessionLimits, ViewMembers } from './messages.js';
import { Canvas, readTile, type Picture, type Tile } from './picture.js';
import type { FrameStats, Method, Records } from './records.js';
import { ClosedError, Rpc, RpcError, type JsonObject } from './rpc.js';
import { addressOf, openSocket } from './socket.js';

export interface ConnectOptions {
    /** A name for people. */
    client?: string;
    /** Of a server with many scenes: the id of the project; '': none, for `project.list` and the like. Default: that of the page's URL. */
    project?: string;
    /** What is waited for comes within that time, or fails; what grows better meanwhile has it for each next step. */
    timeoutMs?: number;
    /**
     * For how long a connection that broke is tried anew. The session then goes on: its name, its undo, its views, its sensors; edits
     * that were not answered are made once, whether or not the server had them. 0, the default: what waits fails with ClosedError.
     */
    reconnectMs?: number;
}

/** As scene.get tells it with expand: the fields of its type, null where they are left out. Arrays in bulk are counts. */
export type SceneRecord = { [T in keyof Records]: { type: T } & Partial<Records[T]> }[keyof Records];

const TIMEOUT_MS = 60_000;
/** WebSocket.CLOSED, of whatever class. */
const CLOSED = 3;

/** page: as the server prints it. */
export async function connect(page: string, options: ConnectOptions = {}): Promise<Session> {
    const { address, token, project } = addressOf(page);
    const wanted = options.project ?? project;
    const timeoutMs = options.timeoutMs ?? TIMEOUT_MS;
    const hello = { client: options.client ?? 'javascript', ...(token !== null && { token }), ...(wanted && { project: wanted }) };
    const session = new Session(await openSocket(address, timeoutMs), timeoutMs, { address, hello, forMs: options.reconnectMs ?? 0 });
    try {
        await session.hello(hello);
    } catch (error) {
        await session.close();
        throw error;
    }
    return session;
}

/** How a session comes back. */
interface Return {
    address: string;
    hello: Params['session.hello'];
    forMs: number;
}

const FIRST_RETRY_MS = 100;
const LAST_RETRY_MS = 5000;
/**
 * Close codes after which there is no coming back: a message that is refused, and would be again; wrong token, taken away, ended by
 * an administrator, gone on elsewhere.
 */
const FINAL: readonly number[] = [1003, 1009, 4001, 4003, 4004, 4009];
/** What refuses a hello for the moment. */
const PASSING: readonly string[] = ['limit_exceeded', 'busy'];
/** The longest that timers count. */
const LONGEST_MS = 2 ** 31 - 1;

/** Change nothing, and are of no view: where the connection breaks before the answer they are asked again. */
const QUESTIONS: readonly Method[] = ['scene.get', 'stats.get', 'daylight', 'photometry', 'bounds', 'probe', 'sensor.read', 'asset.list', 'asset.photometry', 'project.list', 'version.list'];

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
    private rpc!: Rpc;
    private socket!: WebSocket;
    private key = '';
    /** Counts the hellos that were to go on with the session, and did not: what the server knew of it is gone. */
    private lives = 0;
    /** While the connection is away: until it is there again, or for good. */
    private away: Promise<void> | null = null;
    private edits = 0;
    /** Tells this page's edits from those of others with its name. */
    private readonly prefix = Math.random().toString(36).slice(2, 10);
    private readonly views = new Map<number, View>();
    /** Those of them that somebody has. */
    private readonly opened = new Set<View>();
    private readonly sensors = new Map<string, SensorValue>();
    private readonly listeners = new Map<string, Set<(params: never) => void>>();
    /** Looked at again after each message. */
    private readonly waiting = new Set<() => void>();
    private tiles: Promise<void> = Promise.resolve();
    private watching = false;
    /** What was told last of the project that is being opened. */
    private opening: unknown = null;
    private broken: Error | null = null;
    /** Whoever tries to come back leaves it. */
    private readonly stop = new AbortController();
    private ended: () => void = () => undefined;
    private readonly closed = new Promise<void>((resolve) => (this.ended = resolve));

    /** Of connect(). */
    constructor(
        socket: WebSocket,
        private readonly timeoutMs: number,
        private readonly back: Return,
    ) {
        this.attach(socket);
    }

    private attach(socket: WebSocket): void {
        this.socket = socket;
        this.rpc = new Rpc((text) => socket.send(text), (method, params) => this.notified(method, params));
        socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => socket === this.socket && this.received(event.data);
        socket.onerror = () => undefined; // its end is told by what follows
        socket.onclose = (event) => socket === this.socket && this.lost(event);
    }

    private lost(event: { code: number; reason: string }): void {
        const why = new ClosedError(event.reason || `the connection is closed (${event.code})`);
        if (this.broken || this.key === '' || this.back.forMs <= 0 || FINAL.includes(event.code)) {
            this.end(why);
            this.ended();
            return;
        }
        this.rpc.close();
        if (!this.away) {
            this.away = this.comeBack(why).finally(() => (this.away = null));
            this.away.catch(() => undefined); // who waits for it hears of it
        }
    }

    async hello(params: Params['session.hello']): Promise<void> {
        const hello = await this.greeted(params);
        this.name = hello.session;
        this.key = hello.key;
        this.role = hello.role;
        this.saved = hello.saved;
        this.project = hello.project;
        this.limits = hello.limits;
        this.rpc.mostBytes = hello.limits.message_bytes;
        if (params.resume !== undefined && !hello.resumed) {
            this.lives++;
            this.sensors.clear();
            this.sceneRev = 0;
        }
        this.sceneRev = Math.max(this.sceneRev, hello.scene_rev ?? 0);
    }

    /** Until the server is there, or the time is over. Views are of a connection: they are opened again. */
    private async comeBack(why: Error): Promise<void> {
        const until = Date.now() + this.back.forMs;
        const left = (): number => Math.max(0, until - Date.now());
        for (let pause = FIRST_RETRY_MS; !this.broken; pause = Math.min(2 * pause, LAST_RETRY_MS)) {
            await pauseOf(Math.min(pause, left()), this.stop.signal);
            try {
                await within(this.resume(), Math.max(1, left()), 'no connection');
                this.news();
                return;
            } catch (error) {
                this.letGo();
                const isFinal = error instanceof RpcError && !PASSING.includes(error.app);
                if (isFinal || left() === 0) this.end(isFinal ? error : why);
            }
        }
        this.ended();
        throw this.broken;
    }

    private async resume(): Promise<void> {
        if (this.broken) throw this.broken;
        const socket = await openSocket(this.back.address, this.timeoutMs, this.stop.signal);
        this.tiles = Promise.resolve();
        this.attach(socket);
        await this.hello({ ...this.back.hello, resume: this.name, key: this.key, scene_rev: this.sceneRev });
        if (this.watching) this.watching = await this.accepted(this.rpc.call('sensor.watch', { on: true, points: true }));
        this.views.clear();
        for (const view of this.opened) await this.reopen(view);
    }

    /** False: the server refused it. */
    private accepted(asked: Promise<unknown>): Promise<boolean> {
        return asked.then(
            () => true,
            (error: unknown) => {
                if (error instanceof RpcError) return false;
                throw error;
            },
        );
    }

    /** Of an attempt that failed: or its end would be taken for one of the next. */
    private letGo(): void {
        this.rpc.close();
        this.socket.onclose = null;
        if (this.socket.readyState !== CLOSED) this.socket.close(1000);
    }

    /** Frames of it may have come before the answer that tells its new number. */
    private async reopen(view: View): Promise<void> {
        const asked = this.rpc.call('view.open', view.renewed()) as Promise<unknown> as Promise<Answers['view.open']>;
        const refused = (error: unknown): void => {
            if (!(error instanceof RpcError)) throw error;
            this.opened.delete(view);
            view.refused = error; // the session goes on without it
        };
        await asked.then(({ view_id: id }) => {
            view.goOn(id, this.views.get(id));
            this.views.set(id, view);
        }, refused);
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
        if (this.socket.readyState === CLOSED) this.ended(); // it was away, and nothing tells of it any more
        await this.closed;
    }

    // ---- messages ----

    /** Any request of PROTOCOL.md. Fails with RpcError where the server refuses, with ClosedError where it is gone. */
    call<M extends Method>(method: M, params: Params[M], timeoutMs = this.timeoutMs): Promise<Answers[M]> {
        if (this.away) return this.ready(timeoutMs).then(() => this.call(method, params, timeoutMs));
        const answer = this.rpc.call(method, params as JsonObject) as Promise<unknown> as Promise<Answers[M]>;
        const asked = within(answer, timeoutMs, `no answer to ${method}`);
        if (!QUESTIONS.includes(method)) return asked;
        return asked.catch((error: unknown) => {
            if (error instanceof ClosedError && this.away) return this.call(method, params, timeoutMs);
            throw error;
        });
    }

    /** As soon as there is a connection: what is read then is of that one. */
    async ready(timeoutMs = this.timeoutMs): Promise<void> {
        while (this.away) await within(this.away, timeoutMs, 'no connection');
    }

    /** What of the scene's revisions is known to be there: none of them where the server does not know this session any more. */
    since(): () => number {
        const { lives, sceneRev } = this;
        return () => (lives === this.lives ? sceneRev : 0);
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
        const { rpc } = this;
        const tile = readTile(decodeFrame(data));
        tile.catch(() => undefined); // it is looked at below, later
        this.tiles = this.tiles
            .then(async () => this.show(await tile, rpc))
            .catch((error: unknown) => rpc === this.rpc && this.fail(error))
            .then(() => this.news());
    }

    /** What came by a connection that broke meanwhile is of no view any more. */
    private show(tile: Tile | null, rpc: Rpc): void {
        if (!tile || this.broken || rpc !== this.rpc) return;
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
        this.stop.abort();
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
                    if (this.broken || progress() !== before || ready() !== null) resolve();
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
        return this.revOf(await this.made('scene.apply', { ops, ...members }));
    }

    async undo(): Promise<number> {
        return this.revOf(await this.made('scene.undo', {}));
    }

    async redo(): Promise<number> {
        return this.revOf(await this.made('scene.redo', {}));
    }

    /** An edit, once: where the connection breaks before its answer it is sent again by its op_id, and the server knows whether it had it. */
    private async made<M extends 'scene.apply' | 'scene.undo' | 'scene.redo'>(method: M, params: Params[M]): Promise<Answers[M]> {
        const edit = { op_id: `${this.prefix}-${++this.edits}`, ...params };
        await this.ready();
        const { lives } = this;
        for (let repeat = false; ; repeat = true) {
            try {
                return await this.call(method, { ...edit, ...(repeat && { repeat }) });
            } catch (error) {
                if (!(error instanceof ClosedError) || !this.away) throw error;
                await this.ready(LONGEST_MS); // it ends when coming back does
                if (lives !== this.lives) throw new ClosedError('the server does not know this session any more: nobody can tell whether this edit was made');
            }
        }
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
        const opened: ViewMembers & { size: readonly [number, number] } = { ...rest, size: [width, height], codec };
        const view = this.viewOf((await this.call('view.open', opened)).view_id);
        view.opened(opened);
        this.opened.add(view);
        return view;
    }

    /** Of View.close(). */
    forget(view: View): void {
        this.opened.delete(view);
        this.views.delete(view.id);
    }

    /** What a sensor says of the scene as it is, as soon as that is `enough`; when nothing else is said: as exact as it gets. */
    async sensor(id: string, enough: (value: SensorValue) => boolean = ({ settled }) => settled): Promise<SensorValue> {
        await this.call('sensor.read', { id }); // refused where there is none
        const rev = this.since();
        if (!this.watching) await this.call('sensor.watch', { on: true, points: true });
        this.watching = true;
        const known = (): SensorValue | null => {
            const value = this.sensors.get(id);
            return value && value.scene_rev >= rev() && (value.settled || enough(value)) ? value : null;
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
        timer = setTimeout(() => reject(new Error(`${what} within ${timeoutMs / 1000} s`)), Math.min(timeoutMs, LONGEST_MS));
    });
    return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/** It ends early where nobody waits for it any more. */
function pauseOf(ms: number, stop: AbortSignal): Promise<void> {
    return new Promise((resolve) => {
        const over = (): void => {
            clearTimeout(timer);
            stop.removeEventListener('abort', over);
            resolve();
        };
        const timer = setTimeout(over, ms);
        stop.addEventListener('abort', over);
        if (stop.aborted) over();
    });
}

/** Of Session.view(). */
export class View {
    private canvas = new Canvas();
    private stats = new Map<number, FrameStats>();
    private cameraSeq = 0;
    private last: FrameHeader | null = null;
    /** What it was asked for in all. */
    private members: JsonObject = {};
    /** A new connection could not have it: there is no such view any more. */
    refused: RpcError | null = null;

    constructor(
        private readonly session: Session,
        /** On a new connection it is another one. */
        public id: number,
    ) {}

    opened(members: ViewMembers): void {
        this.members = members as unknown as JsonObject;
    }

    /** What opens it again as it is. */
    renewed(): JsonObject {
        return { ...this.members, camera_seq: ++this.cameraSeq };
    }

    /** As view `id` of a new connection; early: what came of that already. */
    goOn(id: number, early: View | undefined): void {
        this.id = id;
        this.canvas = early?.canvas ?? new Canvas();
        this.stats = early?.stats ?? new Map<number, FrameStats>();
        this.last = early?.last ?? null;
    }

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
        const rev = this.session.since(), { cameraSeq } = this;
        const shown = (): Picture | null => {
            const { last } = this;
            if (this.refused) throw this.refused;
            if (!last || last.sceneRev < rev() || last.cameraSeq < cameraSeq || (converged && !(last.flags & Flag.converged))) return null;
            return this.canvas.picture(this.stats.get(last.frameSeq) ?? null);
        };
        return this.session.wait(shown, `view ${this.id} got no such picture`, () => this.refused ?? this.last);
    }

    async update(members: Omit<ViewMembers, 'codec' | 'camera_seq'>): Promise<void> {
        await this.ready();
        const cameraSeq = ++this.cameraSeq;
        try {
            await this.session.call('view.update', { ...members, view_id: this.id, camera_seq: cameraSeq });
        } catch (error) {
            if (!(error instanceof RpcError)) this.remember(members); // where the answer is lost it may be so, and shall be
            throw error;
        }
        this.remember(members);
    }

    /** As the server does: a camera of the scene takes the place of one that is told, and the other way; effects are told one by one. */
    private remember(told: ViewMembers): void {
        const members = { ...told };
        delete members.resend;
        const { camera, camera_id: cameraId, ...known } = this.members as unknown as ViewMembers;
        const chosen = members.camera ?? members.camera_id;
        const before = { ...known, ...(camera && { camera }), ...(cameraId !== undefined && { camera_id: cameraId }) };
        const effects = { ...known.effects, ...members.effects };
        this.members = { ...(chosen === undefined ? before : known), ...members, effects } as unknown as JsonObject;
    }

    /** What the picture has there: `value` in `unit`, cd/m2 or lx, and its `error`, each null where it is not known. */
    async read(x: number, y: number): Promise<Answers['view.read']> {
        await this.ready();
        return this.session.call('view.read', { view_id: this.id, x, y });
    }

    /** What is under a pixel; `id` null: nothing. */
    async pick(x: number, y: number): Promise<Answers['pick']> {
        await this.ready();
        return this.session.call('pick', { view_id: this.id, x, y });
    }

    /** Where the connection breaks meanwhile it is gone with that. */
    async close(): Promise<void> {
        await this.session.ready();
        try {
            if (!this.refused) await this.session.call('view.close', { view_id: this.id });
        } finally {
            this.session.forget(this);
        }
    }

    /** The number is that of the connection there is. */
    private async ready(): Promise<void> {
        await this.session.ready();
        if (this.refused) throw this.refused;
    }
}
