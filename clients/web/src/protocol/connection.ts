/** One WebSocket to the daemon that says hello and comes back by itself. Knows messages, not what they mean. */
import { ClosedError, isObject, Rpc, RpcError, type JsonObject } from './rpc';
import { numberOr, stringOr } from './types';

export const SUBPROTOCOL = 'lumend.v1';

export type ConnectionState =
    | { at: 'connecting' }
    /** The server is there, and opens the project; `waiting`: something else has to end first. */
    | { at: 'opening'; stage: 'opening' | 'waiting'; waitedS: number }
    | { at: 'online' }
    /** Lost; the next try starts at `retryAt` (performance.now() clock). */
    | { at: 'waiting'; retryAt: number; reason: string }
    /** The token was refused: trying again by itself is pointless. */
    | { at: 'refused'; reason: string }
    /** By an administrator: who was sent away does not come back by itself. */
    | { at: 'ended'; reason: string };

export interface ConnectionEvents {
    onState(state: ConnectionState): void;
    onOnline(rpc: Rpc, hello: JsonObject): void;
    /** The newest revision of the scene that is known here; null: none for sure. */
    sceneRev(): number | null;
    onNotification(method: string, params: JsonObject): void;
    onBinary(message: ArrayBuffer): void;
    /** Every BEAT_MS while online: send something that is answered at once. */
    onBeat(): void;
    /** True: for two beats nothing was heard. False: something is, again. */
    onStalled(stalled: boolean): void;
    /** The project is not there, or cannot be opened: the connection goes on without one. */
    onTurnedAway(reason: string): void;
}

const FIRST_RETRY_MS = 300;
const LAST_RETRY_MS = 8000;
/**
 * Silence is counted in beats, not in seconds: browsers let a hidden tab's timers run once a minute, and a question that was
 * never asked is no silence.
 */
export const BEAT_MS = 2000;
/** The question of one beat is not answered at the next: two of these, 4 s at most, and the user is told. */
export const STALLED_BEATS = 2;
/** With nothing heard for so many, the connection is dead. */
export const DEAD_BEATS = 10;

/** Doubles with every failure, with up to a quarter of jitter so that many clients do not come back at once. */
export function retryDelay(failures: number, random: number): number {
    return Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** Math.min(failures, 20)) * (1 - 0.25 * random);
}

/** Close code: another connection went on with this session. */
const GONE_ON_ELSEWHERE = 4009;
/** Close code: an administrator ended the session. */
const ENDED = 4004;

export class Connection {
    private socket: WebSocket | null = null;
    private rpc: Rpc | null = null;
    private failures = 0;
    private retryTimer = 0;
    private beatTimer = 0;
    /** Beats since anything was heard. */
    private silence = 0;
    private online = false;
    /** Of the last hello: the next one goes on with that session. */
    private session = '';
    private key = '';
    private closingReason = '';

    constructor(
        private readonly url: string,
        private token: string | null,
        private readonly events: ConnectionEvents,
        /** Of a server with many scenes: whose; '': none's, or the one there is. */
        private project = '',
    ) {}

    setToken(token: string): void {
        this.token = token;
        this.connect();
    }

    connect(): void {
        clearTimeout(this.retryTimer);
        this.drop();
        this.events.onState({ at: 'connecting' });
        const socket = new WebSocket(this.url, SUBPROTOCOL);
        socket.binaryType = 'arraybuffer';
        const rpc = new Rpc(
            (text) => socket.send(text),
            (method, params) => this.notified(method, params),
        );
        this.socket = socket;
        this.rpc = rpc;
        this.closingReason = '';
        socket.onopen = () => void this.hello(socket, rpc);
        socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
            if (this.socket !== socket) return;
            this.heard();
            if (typeof event.data === 'string') rpc.receive(event.data);
            else this.events.onBinary(event.data);
        };
        socket.onclose = (event) => {
            if (this.socket !== socket) return;
            if (event.code === GONE_ON_ELSEWHERE) this.session = this.key = ''; /* or both would send each other away for ever */
            if (event.code === ENDED) this.ended(event.reason);
            else this.lost(event.reason);
        };
        this.silence = 0;
        this.beatTimer = setInterval(() => this.beat(), BEAT_MS) as unknown as number;
    }

    private async hello(socket: WebSocket, rpc: Rpc): Promise<void> {
        try {
            const params: JsonObject = { client: 'lumend-web' };
            if (this.token !== null) params.token = this.token;
            if (this.project) params.project = this.project;
            if (this.key) Object.assign(params, this.comeback());
            const hello = await rpc.call('session.hello', params);
            if (this.socket !== socket) return;
            this.session = stringOr(hello.session, '');
            this.key = stringOr(hello.key, '');
            rpc.mostBytes = isObject(hello.limits) ? numberOr(hello.limits.message_bytes, Infinity) : Infinity;
            this.failures = 0;
            this.online = true;
            this.events.onState({ at: 'online' });
            this.events.onOnline(rpc, hello);
        } catch (error) {
            if (this.socket !== socket || error instanceof ClosedError) return;
            if (error instanceof RpcError && error.app === 'not_authorised') {
                this.drop();
                this.events.onState({ at: 'refused', reason: error.message });
            } else if (error instanceof RpcError && error.path === 'project' && error.app !== 'busy') {
                this.project = this.session = this.key = '';
                this.events.onTurnedAway(error.message);
                this.connect();
            } else {
                this.lost(error instanceof Error ? error.message : String(error));
            }
        }
    }

    private comeback(): JsonObject {
        const rev = this.events.sceneRev();
        return { resume: this.session, key: this.key, ...(rev === null ? {} : { scene_rev: rev }) };
    }

    private notified(method: string, params: JsonObject): void {
        if (method === 'session.closing') {
            this.closingReason = typeof params.reason === 'string' ? params.reason : 'the server is shutting down';
        }
        if (method === 'project.opening' && !this.online) {
            this.events.onState({ at: 'opening', stage: params.stage === 'waiting' ? 'waiting' : 'opening', waitedS: numberOr(params.waited_s, 0) });
            return;
        }
        this.events.onNotification(method, params);
    }

    private beat(): void {
        this.silence++;
        if (this.silence >= DEAD_BEATS) {
            this.lost('the server stopped answering');
            return;
        }
        if (this.online && this.silence === STALLED_BEATS) this.events.onStalled(true);
        if (this.online) this.events.onBeat();
    }

    private heard(): void {
        if (this.online && this.silence >= STALLED_BEATS) this.events.onStalled(false);
        this.silence = 0;
    }

    private lost(reason: string): void {
        const why = this.closingReason || reason || 'the server cannot be reached';
        this.drop();
        const delay = retryDelay(this.failures++, Math.random());
        this.events.onState({ at: 'waiting', retryAt: performance.now() + delay, reason: why });
        this.retryTimer = setTimeout(() => this.connect(), delay) as unknown as number;
    }

    private ended(reason: string): void {
        this.drop();
        this.session = this.key = '';
        this.events.onState({ at: 'ended', reason });
    }

    private drop(): void {
        clearInterval(this.beatTimer);
        this.online = false;
        const socket = this.socket;
        this.socket = null;
        this.rpc?.close();
        this.rpc = null;
        if (socket) socket.close();
    }
}
