import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import type { Imports } from './imports';
import type { SceneRecord } from '../protocol/types';
import { isHidden, mainOf, skyOps, Uploads, type Named } from './uploads';

test('the file that the others belong to is found', () => {
    assert.deepEqual(mainOf(['wood.png', 'chair/parts/leg.obj', 'chair/chair.GLTF', 'lamp.ies']), { name: 'chair/chair.GLTF', kind: 'model' });
    assert.deepEqual(mainOf(['a.ldt', 'sky.exr']), { name: 'a.ldt', kind: 'lamp' });
    assert.deepEqual(mainOf(['sky.hdr']), { name: 'sky.hdr', kind: 'sky' });
    assert.equal(mainOf(['a.png', 'glb', 'x.glb.txt']), null);
    assert.ok(isHidden('.DS_Store') && isHidden('a/.b') && !isHidden('a.b/c'));
});

function rig(answer: () => Promise<JsonObject>) {
    const asked: JsonObject[] = [], did: string[] = [];
    const imports = {
        busy: signal(false), problem: signal(''), progress: signal(null),
        bring: (asset: string) => Promise.resolve(did.push(`bring ${asset}`) > 0),
    } as unknown as Imports;
    const uploads = new Uploads({
        imports,
        call: (method, params) => (asked.push({ method, ...params }), Promise.resolve({ put: 'upload/t' })),
        put: (path, body) => (did.push(`put ${path} ${body.size}`), answer()),
        hang: (asset) => Promise.resolve(did.push(`hang ${asset}`)),
        surround: (asset) => (did.push(`surround ${asset}`), Promise.resolve(null)),
    });
    uploads.offered.value = true;
    return { imports, uploads, asked, did };
}
const named = (name: string, text: string): Named => ({ name, file: new Blob([text]) as File });

test('what is dropped is announced, put in its order, and used', async () => {
    const { uploads, asked, did, imports } = rig(() => Promise.resolve({ folder: 'upload/f' }));
    await uploads.send([named('.DS_Store', 'x'), named('c.gltf', '123'), named('c.bin', '4567')]);
    assert.deepEqual(asked, [{ method: 'asset.upload', files: [{ name: 'c.gltf', bytes: 3 }, { name: 'c.bin', bytes: 4 }] }]);
    assert.deepEqual(did, ['put upload/t 7', 'bring upload/f/c.gltf']);
    await uploads.send([named('l.ies', '1')]);
    await uploads.send([named('s.hdr', '1')]);
    assert.deepEqual(did.slice(2), ['put upload/t 1', 'hang upload/f/l.ies', 'put upload/t 1', 'surround upload/f/s.hdr']);
    assert.equal(imports.problem.value, '');
});

test('what is refused is said, and nothing is used', async () => {
    const full = rig(() => Promise.resolve({ error: 'cannot write a' }));
    await full.uploads.send([named('c.glb', '1')]);
    assert.equal(full.imports.problem.value, 'cannot write a');
    const cut = rig(() => Promise.reject(new Error('cut off')));
    await cut.uploads.send([named('c.glb', '1')]);
    assert.equal(cut.imports.problem.value, 'cut off');
    assert.equal(cut.imports.busy.value, false);
    await cut.uploads.send([named('c.txt', '1')]);
    assert.match(cut.imports.problem.value, /None of these files/);
    assert.deepEqual([...full.did, ...cut.did], ['put upload/t 1', 'put upload/t 1']);
});

test('a sky has ids of its own, and takes the place of daylight that was there, and of no lamp', () => {
    const taken = new Set(['sky', 'sky-image']);
    const light = (id: string, kind: string, on = true): SceneRecord => ({ type: 'light', id, kind, on });
    const lights = [light('default-sky', 'environment'), light('default-sun', 'directional'), light('dusk', 'sky', false), light('noon', 'sun'), light('spot', 'directional')];
    const ops = skyOps('a.hdr', lights, (id) => taken.has(id));
    assert.deepEqual(ops.map((op) => `${op.op} ${op.id}`), ['set default-sky', 'set default-sun', 'set noon', 'add sky-image-2', 'add sky-2']);
});
