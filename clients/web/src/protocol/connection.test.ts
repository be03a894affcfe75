import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FakeTimers } from '../lib/fake_timers';
import { BEAT_MS, Connection, DEAD_BEATS, STALLED_BEATS } from './connection';

/** A socket that answers what it is told to. */
class FakeSocket {
    static all: FakeSocket[] = [];
    onopen?: () => void;
    onmessage?: (event: { data: string }) => void;
    onclose?: (event: { code?: number; reason: string }) => void;
    sent: { id?: number; method: string; params?: object }[] = [];
    closed = false;
    constructor() {
        FakeSocket.all.push(this);
    }
    send(text: string): void {
        this.sent.push(JSON.parse(text) as { id: number; method: string; params: object });
    }
    close(): void {
        this.closed = true;
    }
    answerAll(result: object = {}): void {
        for (const { id } of this.sent.splice(0)) this.onmessage?.({ data: JSON.stringify({ jsonrpc: '2.0', id, result }) });
    }
}

const settle = async (): Promise<void> => {
    for (let i = 0; i < 8; i++) await Promise.resolve();
};

async function online(): Promise<{ log: string[]; socket: FakeSocket; link: Connection; timers: FakeTimers }> {
    const timers = new FakeTimers();
    FakeSocket.all = [];
    (globalThis as { WebSocket?: unknown }).WebSocket = FakeSocket;
    const log: string[] = [];
    let rpc: { call(method: string): Promise<unknown> } | null = null;
    const link = new Connection('ws://test', null, {
        onState: (state) => log.push(state.at),
        onOnline: (r) => (rpc = r),
        onNotification: () => undefined,
        sceneRev: () => 7,
        onBinary: () => undefined,
        onBeat: () => void rpc?.call('frame.ack').catch(() => undefined),
        onStalled: (stalled) => log.push(stalled ? 'stalled' : 'answers'),
        onTurnedAway: (reason) => log.push(reason),
    });
    link.connect();
    const socket = FakeSocket.all[0]!;
    socket.onopen?.();
    socket.answerAll();
    await settle();
    return { log, socket, link, timers };
}

test('a server that answers is asked for ever, and the connection stays', async () => {
    const { log, socket, timers } = await online();
    for (let i = 0; i < 100; i++) {
        timers.tick(BEAT_MS);
        assert.deepEqual(socket.sent.map((m) => m.method), ['frame.ack']);
        socket.answerAll();
    }
    assert.deepEqual(log, ['connecting', 'online']);
    timers.reset();
});

test('one that stops answering is told within five seconds, and given up after twenty', async () => {
    const { log, socket, timers } = await online();
    timers.tick(BEAT_MS * STALLED_BEATS - 1);
    assert.deepEqual(log, ['connecting', 'online']);
    timers.tick(1);
    assert.ok(BEAT_MS * STALLED_BEATS < 5000);
    assert.deepEqual(log, ['connecting', 'online', 'stalled']);
    socket.answerAll();
    assert.deepEqual(log.slice(3), ['answers'], 'an answer that was only slow');
    timers.tick(BEAT_MS * (DEAD_BEATS - 1));
    assert.deepEqual(log.slice(4), ['stalled']);
    timers.tick(BEAT_MS);
    assert.deepEqual(log.slice(5), ['waiting']);
    assert.ok(socket.closed);
    timers.reset();
});

test('timers that run once a minute, as those of a hidden tab, end no connection', async () => {
    const { log, socket, timers } = await online();
    // A browser lets the timer fire once where it was due thirty times: one beat is a beat, however late it comes.
    for (let minute = 0; minute < 60; minute++) {
        timers.tick(BEAT_MS);
        socket.answerAll();
    }
    assert.deepEqual(log, ['connecting', 'online']);
    timers.reset();
});

test('what an old socket still says is not heard', async () => {
    const { log, socket, link, timers } = await online();
    link.connect();
    socket.onclose?.({ reason: 'late' });
    socket.onmessage?.({ data: 'not even JSON' });
    assert.deepEqual(log, ['connecting', 'online', 'connecting']);
    timers.reset();
});

test('who was sent away by an administrator comes back when asked to, in a session of its own', async () => {
    const { log, socket, link, timers } = await online();
    socket.onclose?.({ code: 4004, reason: 'an administrator ended the session' });
    assert.deepEqual(log, ['connecting', 'online', 'ended']);
    timers.tick(60000);
    assert.equal(log.length, 3);
    link.connect();
    FakeSocket.all[1]!.onopen?.();
    assert.deepEqual(FakeSocket.all[1]!.sent[0]!.params, { client: 'lumend-web' });
    timers.reset();
});

test('the next connection goes on with the session of the last one, and says what it knows', async () => {
    const { link, socket, timers } = await online();
    link.connect(); // the first server told no session
    FakeSocket.all[1]!.onopen?.();
    assert.deepEqual(FakeSocket.all[1]!.sent[0]!.params, { client: 'lumend-web' });
    FakeSocket.all[1]!.answerAll({ session: 'ann.0-1', key: 'k' });
    await settle();
    link.connect();
    FakeSocket.all[2]!.onopen?.();
    assert.deepEqual(FakeSocket.all[2]!.sent[0]!.params, { client: 'lumend-web', resume: 'ann.0-1', key: 'k', scene_rev: 7 });
    assert.ok(socket.closed);
    timers.reset();
});

test('who is turned away from a project goes on without one', async () => {
    const timers = new FakeTimers();
    FakeSocket.all = [];
    const log: string[] = [];
    const link = new Connection(
        'ws://test',
        null,
        {
            onState: (state) => log.push(state.at),
            onOnline: () => undefined,
            onNotification: () => undefined,
            sceneRev: () => 7,
            onBinary: () => undefined,
            onBeat: () => undefined,
            onStalled: () => undefined,
            onTurnedAway: (reason) => log.push(reason),
        },
        'abc',
    );
    link.connect();
    const [first] = FakeSocket.all;
    first!.onopen?.();
    assert.deepEqual(first!.sent[0]!.params, { client: 'lumend-web', project: 'abc' });
    const error = { code: -32000, message: 'in the trash', data: { code: 'not_found', path: 'project' } };
    first!.onmessage?.({ data: JSON.stringify({ jsonrpc: '2.0', id: first!.sent[0]!.id, error }) });
    await settle();
    FakeSocket.all[1]!.onopen?.();
    assert.deepEqual(FakeSocket.all[1]!.sent[0]!.params, { client: 'lumend-web' });
    assert.deepEqual(log, ['connecting', 'in the trash', 'connecting']);
    timers.reset();
});

test('a project that takes long to be opened is told, and waited for', async () => {
    const timers = new FakeTimers();
    FakeSocket.all = [];
    (globalThis as { WebSocket?: unknown }).WebSocket = FakeSocket;
    const log: string[] = [];
    const link = new Connection('ws://test', null, {
        onState: (state) => log.push(state.at === 'opening' ? `${state.stage} ${state.waitedS}` : state.at),
        onOnline: () => undefined,
        onNotification: (method) => log.push(method),
        sceneRev: () => null,
        onBinary: () => undefined,
        onBeat: () => undefined,
        onStalled: (stalled) => log.push(stalled ? 'stalled' : 'answers'),
        onTurnedAway: (reason) => log.push(reason),
    }, 'abc');
    link.connect();
    const socket = FakeSocket.all[0]!;
    const tell = (stage: string, waited: number): void =>
        socket.onmessage?.({ data: JSON.stringify({ jsonrpc: '2.0', method: 'project.opening', params: { project: 'abc', stage, waited_s: waited } }) });
    socket.onopen?.();
    tell('waiting', 0);
    for (let s = 2; s <= 10 * DEAD_BEATS; s += 2) {
        timers.tick(2000);
        tell('opening', s);
    }
    assert.deepEqual(log.slice(0, 3), ['connecting', 'waiting 0', 'opening 2']);
    assert.equal(log.length, 2 + 5 * DEAD_BEATS);
    assert.equal(socket.closed, false);
    socket.answerAll();
    await settle();
    assert.deepEqual(log.slice(-2), [`opening ${10 * DEAD_BEATS}`, 'online']);
    timers.reset();
});
