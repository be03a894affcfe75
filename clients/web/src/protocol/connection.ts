/** One WebSocket to the daemon that says hello and comes back by itself. Knows messages, not what they mean. */
import { ClosedError, Rpc, RpcError, type JsonObject } from './rpc';

export const SUBPROTOCOL = 'lumend.v1';

export type ConnectionState =
    | { at: 'connecting' }
    | { at: 'online' }
    /** Lost; the next try starts at `retryAt` (performance.now() clock). */
    | { at: 'waiting'; retryAt: number; reason: string }
    /** The token was refused: trying again by itself is pointless. */
    | { at: 'refused'; reason: string };

export interface ConnectionEvents {
    onState(state: ConnectionState): void;
    onOnline(rpc: Rpc, hello: JsonObject): void;
    onNotification(method: string, params: JsonObject): void;
    onBinary(message: ArrayBuffer): void;
}

const FIRST_RETRY_MS = 300;
const LAST_RETRY_MS = 8000;
/** A connection on which nothing is heard for this long is dead: the client asks for stats every two seconds. */
const SILENCE_MS = 20000;

/** Doubles with every failure, with up to a quarter of jitter so that many clients do not come back at once. */
export function retryDelay(failures: number, random: number): number {
    return Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** Math.min(failures, 20)) * (1 - 0.25 * random);
}

export class Connection {
    private socket: WebSocket | null = null;
    private rpc: Rpc | null = null;
    private failures = 0;
    private retryTimer = 0;
    private silenceTimer = 0;
    private closingReason = '';

    constructor(
        private readonly url: string,
        private token: string | null,
        private readonly events: ConnectionEvents,
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
            this.heard(socket);
            if (typeof event.data === 'string') rpc.receive(event.data);
            else this.events.onBinary(event.data);
        };
        socket.onclose = (event) => {
            if (this.socket === socket) this.lost(event.reason);
        };
        this.heard(socket);
    }

    private async hello(socket: WebSocket, rpc: Rpc): Promise<void> {
        try {
            const params: JsonObject = { client: 'lumend-web' };
            if (this.token !== null) params.token = this.token;
            const hello = await rpc.call('session.hello', params);
            if (this.socket !== socket) return;
            this.failures = 0;
            this.events.onState({ at: 'online' });
            this.events.onOnline(rpc, hello);
        } catch (error) {
            if (this.socket !== socket || error instanceof ClosedError) return;
            if (error instanceof RpcError && error.app === 'not_authorised') {
                this.drop();
                this.events.onState({ at: 'refused', reason: error.message });
            } else {
                this.lost(error instanceof Error ? error.message : String(error));
            }
        }
    }

    private notified(method: string, params: JsonObject): void {
        if (method === 'session.closing') {
            this.closingReason = typeof params.reason === 'string' ? params.reason : 'the server is shutting down';
        }
        this.events.onNotification(method, params);
    }

    private heard(socket: WebSocket): void {
        clearTimeout(this.silenceTimer);
        this.silenceTimer = setTimeout(() => {
            if (this.socket === socket) this.lost('the server stopped answering');
        }, SILENCE_MS) as unknown as number;
    }

    private lost(reason: string): void {
        const why = this.closingReason || reason || 'the server cannot be reached';
        this.drop();
        const delay = retryDelay(this.failures++, Math.random());
        this.events.onState({ at: 'waiting', retryAt: performance.now() + delay, reason: why });
        this.retryTimer = setTimeout(() => this.connect(), delay) as unknown as number;
    }

    private drop(): void {
        clearTimeout(this.silenceTimer);
        const socket = this.socket;
        this.socket = null;
        this.rpc?.close();
        this.rpc = null;
        if (socket) socket.close();
    }
}
