/** JSON-RPC 2.0 over any text channel: calls are promises, everything else is a notification. */

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json | undefined };
export type JsonObject = { [key: string]: Json | undefined };

export class RpcError extends Error {
    constructor(
        message: string,
        readonly code: number,
        /** Stable application code: "invalid_value", "not_found", ... */
        readonly app: string,
        /** The field that was refused, as "ops/0/value". */
        readonly path: string,
    ) {
        super(message);
    }

    static from(error: JsonObject): RpcError {
        const data = isObject(error.data) ? error.data : {};
        return new RpcError(text(error.message) || 'the server refused', Number(error.code), text(data.code), text(data.path));
    }
}

/** The connection went away before the answer came. */
export class ClosedError extends Error {}

interface Waiting {
    resolve(value: JsonObject): void;
    reject(error: Error): void;
}

export class Rpc {
    private nextId = 1;
    private readonly waiting = new Map<number, Waiting>();
    private closed = false;
    /** What the server takes in one message: it closes the connection at more. */
    mostBytes = Infinity;

    constructor(
        private readonly send: (text: string) => void,
        private readonly onNotification: (method: string, params: JsonObject) => void,
    ) {}

    call(method: string, params: JsonObject = {}): Promise<JsonObject> {
        if (this.closed) return Promise.reject(new ClosedError('not connected'));
        const id = this.nextId++;
        const message = JSON.stringify({ jsonrpc: '2.0', id, method, params });
        if (isLonger(message, this.mostBytes)) {
            return Promise.reject(new RangeError(`${method} is longer than the ${this.mostBytes} bytes that the server takes in a message`));
        }
        return new Promise((resolve, reject) => {
            this.waiting.set(id, { resolve, reject });
            this.send(message);
        });
    }

    notify(method: string, params: JsonObject): void {
        if (!this.closed) this.send(JSON.stringify({ jsonrpc: '2.0', method, params }));
    }

    receive(message: string): void {
        const parsed: unknown = JSON.parse(message);
        if (!isObject(parsed)) throw new TypeError('a message that is not an object');
        if (typeof parsed.method === 'string') {
            this.onNotification(parsed.method, isObject(parsed.params) ? parsed.params : {});
            return;
        }
        const waiting = this.waiting.get(Number(parsed.id));
        if (!waiting) return;
        this.waiting.delete(Number(parsed.id));
        if (isObject(parsed.error)) waiting.reject(RpcError.from(parsed.error));
        else waiting.resolve(isObject(parsed.result) ? parsed.result : {});
    }

    /** Rejects whatever still waits; later calls fail at once. */
    close(): void {
        this.closed = true;
        for (const waiting of this.waiting.values()) waiting.reject(new ClosedError('connection lost'));
        this.waiting.clear();
    }
}

/** In UTF-8, where a unit of UTF-16 takes 1 to 3 bytes. */
const isLonger = (message: string, bytes: number): boolean => 3 * message.length > bytes && new TextEncoder().encode(message).length > bytes;

export function isObject(value: unknown): value is JsonObject {
    return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function text(value: Json | undefined): string {
    return typeof value === 'string' ? value : '';
}
