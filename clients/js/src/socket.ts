/** A WebSocket of lumend.v1: the browser's own, node's own from 22 on, or that of the package ws. */

export const SUBPROTOCOL = 'lumend.v1';

async function socketClass(): Promise<typeof WebSocket> {
    if (typeof WebSocket !== 'undefined') return WebSocket;
    const name = 'ws'; // not a literal: what packs this for browsers does not look for it
    return ((await import(/* @vite-ignore */ name)) as { WebSocket: typeof WebSocket }).WebSocket;
}

/** Where the page of that URL has its WebSocket, the token after #t=, and ?project=. Throws where it is no URL. */
export function addressOf(page: string): { address: string; token: string | null; project: string | null } {
    const url = new URL(page);
    if (!/^(http|ws)s?:$/.test(url.protocol)) throw new TypeError(`${page} is not a URL of lumend: http://HOST:PORT/#t=TOKEN`);
    const token = new URLSearchParams(url.hash.slice(1)).get('t');
    return { address: `${url.protocol.replace('http', 'ws')}//${url.host}${url.pathname}`, token, project: url.searchParams.get('project') };
}

/** Open, or an error that says why not; given up after that time, or when it is told to stop. */
export async function openSocket(address: string, timeoutMs: number, stop?: AbortSignal): Promise<WebSocket> {
    const socket = new (await socketClass())(address, SUBPROTOCOL);
    socket.binaryType = 'arraybuffer';
    return new Promise((resolve, reject) => {
        const over = (): void => {
            clearTimeout(timer);
            stop?.removeEventListener('abort', stopped);
            socket.onopen = null;
            socket.onerror = () => undefined; // that it was closed early is no news
        };
        const fail = (why: string): void => {
            over();
            socket.close();
            reject(new Error(`cannot connect to ${address}${why}: does lumend run there?`));
        };
        const stopped = (): void => fail(', and it is not wanted any more');
        const timer = setTimeout(() => fail(` within ${timeoutMs / 1000} s`), timeoutMs);
        socket.onopen = () => {
            over();
            resolve(socket);
        };
        socket.onerror = (event) => fail('message' in event && typeof event.message === 'string' ? `: ${event.message}` : '');
        stop?.addEventListener('abort', stopped);
        if (stop?.aborted) stopped();
    });
}
