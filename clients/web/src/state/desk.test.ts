import assert from 'node:assert/strict';
import { test } from 'node:test';
import { deskOf, inWords, nextAddress } from './desk';

test('what the server hears of a desk', () => {
    assert.equal(deskOf({ desk: null }), null);
    const source = { name: 'desk', priority: 120, rate_hz: 43.9 };
    const status = deskOf({
        desk: {
            sacn: { port: 5568, dropped: 2 },
            artnet: null,
            universes: [{ protocol: 'sacn', universe: 3, late: 0, lost: 4, sources: [source, { ...source, name: '' }] }],
        },
    });
    assert.deepEqual([status?.sacn, status?.artnet, status?.dropped], [5568, null, 2]);
    const universe = status!.universes[0]!;
    assert.equal(inWords(universe), 'desk at 44 Hz, priority 120 and unnamed at 44 Hz, priority 120, 4 lost');
    assert.equal(inWords({ ...universe, sources: [], lost: 0 }), 'silent: the last look holds');
});

test('a new patch takes the next free channel of its universe', () => {
    const patch = (address: number, channels: string, universe = 1) => ({ type: 'patch', id: 'p', target: 'lamp', address, channels, universe });
    assert.equal(nextAddress([], 1), 1);
    assert.equal(nextAddress([patch(5, 'rgb16'), patch(1, 'dim'), patch(100, 'dim', 2)], 1), 11);
    assert.equal(nextAddress([patch(512, 'dim')], 1), 1);
});
