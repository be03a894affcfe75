import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import { Stills } from './stills';

function made() {
    const calls: [string, JsonObject][] = [];
    const opened: ((id: number) => void)[] = [];
    const errors: string[] = [];
    const told: string[] = [];
    const blobs: ((blob: Blob | null) => void)[] = [];
    const canvas = { width: 8, height: 6, dataset: {}, getContext: () => ({ drawImage: () => undefined }), toBlob: (give: (blob: Blob | null) => void) => blobs.push(give) };
    const stills = new Stills({
        call: (method, params) => {
            calls.push([method, params]);
            if (method !== 'view.open') return Promise.resolve({});
            return new Promise((resolve) => opened.push((id) => resolve({ view_id: id })));
        },
        ...{ notify: () => undefined, onError: (e) => errors.push(e.message), announce: (text) => told.push(text), online: signal(true) },
        ...{ pose: () => ({ position: [0, 0, 1], target: [0, 0, 0], up: [0, 1, 0], vfov_deg: 45 }), params: () => ({ size: [8, 6], overlay: 'illuminance' }), restSize: () => [16, 12] },
        ...{ method: () => null, addsSamples: () => true, canvas: () => canvas as unknown as HTMLCanvasElement, save: (name) => told.push(name) },
    });
    const closed = (): unknown[] => calls.filter(([method]) => method === 'view.close').map(([, params]) => params.view_id);
    /** As if a whole frame of it was drawn. */
    const whole = (): void => void Object.assign(stills, { whole: true });
    /** camera_seq of the view that was opened as the nth. */
    const seq = (n: number): number => Number(calls.filter(([method]) => method === 'view.open').at(n)![1].camera_seq);
    return { stills, seq, calls, opened, errors, told, blobs, closed, whole };
}

const settle = async (): Promise<void> => {
    for (let i = 0; i < 20; i++) await Promise.resolve();
};

test('each view that is opened is closed, whatever is begun before it is there', async () => {
    const { stills, seq, opened, closed } = made();
    void stills.start('panorama', 'png', 1024);
    stills.cancel();
    void stills.start('panorama', 'png', 1024);
    assert.deepEqual([stills.owns(1, seq(0)), stills.owns(2, seq(1))], [false, true], 'neither has been answered yet');
    opened[0]!(1);
    await settle();
    assert.deepEqual(closed(), [1], 'it was called off');
    opened[1]!(2);
    await settle();
    assert.equal(stills.owns(2, seq(-1)), true);
    assert.equal(stills.owns(1, seq(-1)), false);
    stills.cancel();
    await settle();
    assert.deepEqual(closed(), [1, 2]);
});

test('while a file is written the next picture is made', async () => {
    const { stills, seq, opened, told, errors, blobs, closed, whole } = made();
    void stills.start('panorama', 'png', 1024);
    opened[0]!(1);
    await settle();
    whole();
    const saving = stills.save();
    assert.equal(stills.progress.value, null);
    void stills.start('picture', 'png', 0);
    opened[1]!(2);
    await settle();
    blobs[0]!(new Blob(['x']));
    await saving;
    assert.deepEqual([told, closed(), stills.owns(2, seq(-1))], [['The panorama is being made', 'The picture is being made', 'panorama.png', 'Saved as panorama.png'], [1], true]);
    whole();
    const second = stills.save();
    blobs[1]!(null);
    await second;
    assert.deepEqual([told.length, errors.length, closed()], [4, 1, [1, 2]], 'what is no file is not said to be one');
});

test('a picture in cd/m2 is one of light, and as fine as the one on screen at rest', () => {
    const { stills, calls } = made();
    void stills.start('picture', 'exr', 0);
    stills.cancel();
    void stills.start('panorama', 'png', 1024);
    assert.deepEqual(calls.map(([, { size, overlay, codec }]) => [size, overlay, codec]), [
        [[16, 12], 'none', 'half_deflate'],
        [[1024, 512], 'illuminance', 'png'],
    ]);
});
