import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { SceneRecord } from '../protocol/types';
import { daylightOf, shiningSky, skyChange } from './daylight';

const light = (id: string, kind: string, more: object = {}): SceneRecord => ({ type: 'light', id, kind, ...more });
const ids = (records: SceneRecord[]): string[] => records.map((r) => r.id);

test('sun and sky are the first by id, and what gives way or shines twice is named', () => {
    const lights = [
        light('sun-2', 'sun'), light('sun-1', 'sun'), light('sky-2', 'sky', { on: false }), light('sky-1', 'sky'),
        light('default-sky', 'environment'), light('off', 'environment', { on: false }), light('afar', 'directional'),
    ];
    const { sun, sky, replaced, doubled } = daylightOf(lights);
    assert.equal(sun?.id, 'sun-1');
    assert.equal(sky?.id, 'sky-1');
    assert.deepEqual(ids(replaced), ['default-sky']);
    const sky3 = light('sky-3', 'sky');
    assert.deepEqual(ids(daylightOf([...lights, sky3]).replaced), ['sky-3', 'default-sky'], 'of two skies one shines');
    assert.equal(shiningSky([...lights, sky3]), 'sky-1');
    assert.deepEqual(ids(doubled), ['sun-2', 'afar']);
});

test('nothing gives way to a sky, and nothing is twice with a sun, that is switched off', () => {
    const { replaced, doubled } = daylightOf([
        light('sun', 'sun', { on: false }), light('sky', 'sky', { on: false }), light('hdr', 'environment'), light('afar', 'directional'),
    ]);
    assert.deepEqual([...replaced, ...doubled], []);
});

test('clouds that close switch the sun off, and those that open switch it on', () => {
    const sky = light('sky', 'sky', { cie_type: 12 });
    assert.deepEqual(skyChange(sky, light('sun', 'sun', { extinction: 0.21 }), 1), [
        { op: 'set', id: 'sky', path: '/cie_type', value: 1 },
        { op: 'set', id: 'sun', path: '/on', value: false },
    ]);
    assert.deepEqual(skyChange({ ...sky, cie_type: 1 }, light('sun', 'sun', { on: false, extinction: 0.21 }), 8), [
        { op: 'set', id: 'sky', path: '/cie_type', value: 8 },
        { op: 'set', id: 'sun', path: '/on', value: true },
        { op: 'set', id: 'sun', path: '/extinction', value: 0.8 },
    ]);
});

test('another clear sky leaves alone the sun that somebody switched off, and an extinction of their own', () => {
    const sky = light('sky', 'sky', { cie_type: 12 });
    assert.deepEqual(skyChange(sky, light('sun', 'sun', { on: false, extinction: 0.3 }), 13), [{ op: 'set', id: 'sky', path: '/cie_type', value: 13 }]);
});
