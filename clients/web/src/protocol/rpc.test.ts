import assert from 'node:assert/strict';
import { test } from 'node:test';
import { retryDelay } from './connection';
import { ClosedError, Rpc, RpcError, type JsonObject } from './rpc';

function pair(): { rpc: Rpc; sent: JsonObject[]; notified: [string, JsonObject][] } {
    const sent: JsonObject[] = [];
    const notified: [string, JsonObject][] = [];
    const rpc = new Rpc(
        (text) => sent.push(JSON.parse(text) as JsonObject),
        (method, params) => notified.push([method, params]),
    );
    return { rpc, sent, notified };
}

test('answers find their calls in any order', async () => {
    const { rpc, sent } = pair();
    const a = rpc.call('a');
    const b = rpc.call('b', { x: 1 });
    assert.deepEqual(sent.map((m) => [m.jsonrpc, m.method, m.params]), [['2.0', 'a', {}], ['2.0', 'b', { x: 1 }]]);
    rpc.receive(JSON.stringify({ jsonrpc: '2.0', id: sent[1]!.id, result: { is: 'b' } }));
    rpc.receive(JSON.stringify({ jsonrpc: '2.0', id: sent[0]!.id, result: { is: 'a' } }));
    assert.deepEqual([await a, await b], [{ is: 'a' }, { is: 'b' }]);
});

test('an error carries the server’s words, code and path', async () => {
    const { rpc, sent } = pair();
    const call = rpc.call('scene.apply', { ops: [] });
    const error = { code: -32000, message: 'must be 0 or more', data: { code: 'invalid_value', path: 'ops/0/flux_lm', min: 0 } };
    rpc.receive(JSON.stringify({ jsonrpc: '2.0', id: sent[0]!.id, error }));
    await assert.rejects(call, (e: RpcError) => {
        assert.deepEqual([e.message, e.code, e.app, e.path], ['must be 0 or more', -32000, 'invalid_value', 'ops/0/flux_lm']);
        return e instanceof RpcError;
    });
});

test('what is longer than the server takes is not sent: it would close the connection, and be sent again', async () => {
    const { rpc, sent } = pair();
    rpc.mostBytes = 100;
    await assert.rejects(rpc.call('scene.apply', { name: 'x'.repeat(100) }), RangeError);
    await assert.rejects(rpc.call('scene.apply', { name: 'ä'.repeat(25) }), RangeError);
    void rpc.call('scene.apply', { name: 'x'.repeat(25) });
    assert.equal(sent.length, 1);
});

test('notifications are passed on; unknown answers are not an error', () => {
    const { rpc, notified } = pair();
    rpc.receive('{"jsonrpc":"2.0","method":"scene.changed","params":{"scene_rev":3}}');
    rpc.receive('{"jsonrpc":"2.0","id":77,"result":{}}');
    assert.deepEqual(notified, [['scene.changed', { scene_rev: 3 }]]);
});

test('closing rejects what waits and what comes after', async () => {
    const { rpc, sent } = pair();
    const call = rpc.call('a');
    rpc.close();
    await assert.rejects(call, ClosedError);
    await assert.rejects(rpc.call('b'), ClosedError);
    rpc.notify('c', {});
    assert.equal(sent.length, 1);
});

test('retries slow down to a limit and are spread', () => {
    const delays = [0, 1, 2, 3, 50].map((n) => retryDelay(n, 0));
    assert.deepEqual(delays, [300, 600, 1200, 2400, 8000]);
    assert.ok(retryDelay(3, 0.999) > 0.74 * retryDelay(3, 0));
});
