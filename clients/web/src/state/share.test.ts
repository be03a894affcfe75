import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { CameraPose } from '../protocol/types';
import { fragmentOf, linkTo, sharedIn, type SharedSettings, type SharedView } from './share';
import { Sharing } from './sharing';
import { PLAIN_FALSE_COLOUR } from './view';

const KNOWN = { methods: ['live', 'path'], effects: ['glossy', 'media'] };
const POSE: CameraPose = { position: [1, 1.6, -4.25], target: [0, 1e-3, 123456.7], up: [0, 1, 0], vfov_deg: 50.5 };
const SETTINGS: SharedSettings = {
    ...{ method: 'path', exposure: { auto: false, ev: 8.3 }, toneMap: 'aces', whiteBalance: 3000, effects: { glossy: 'off', media: 'on' } },
    ...{ overlay: 'illuminance', falseColour: { scale: 'linear', min: 50, max: 750, smooth: true, lines: 'only', palette: 'spectrum' }, solo: ['room/lamp-1', 'key'] },
};
const PLAIN: SharedSettings = { method: null, exposure: null, toneMap: null, whiteBalance: null, effects: {}, overlay: 'none', falseColour: PLAIN_FALSE_COLOUR, solo: [] };
const read = (end: string): SharedView => sharedIn(`#view=1&${end}`, KNOWN)!;

test('what a link is made of comes out of it again', () => {
    assert.deepEqual(sharedIn(`#${fragmentOf(POSE, SETTINGS)}`, KNOWN), { pose: POSE, settings: SETTINGS, refused: [] });
    assert.deepEqual(sharedIn(`#${fragmentOf(POSE, PLAIN)}`, KNOWN), { pose: POSE, settings: {}, refused: [] });
    const auto = sharedIn(fragmentOf(POSE, { ...PLAIN, exposure: { auto: true, ev: 3 } }), KNOWN);
    assert.equal(auto?.settings.exposure?.auto, true);
    assert.equal(sharedIn('#t=secret', KNOWN), null);
    assert.equal(sharedIn('', KNOWN), null);
});

test('each field that is no good is named, and the rest counts', () => {
    const bad: [string, RegExp][] = [
        ['ev=41', /“ev”.*auto, or a number from -40 to 40/],
        ['ev=NaN', /“ev”/],
        ['ev=', /“ev”/],
        ['white=1666', /“white”.*1667 to 25000/],
        ['tone=__proto__', /“tone”.*agx/],
        ['map=constructor', /“map”.*illuminance/],
        ['method=%3Cscript%3E', /“method”.*live, path/],
        ['effects=glossy:maybe', /“effects”/],
        ['effects=toString:off', /“effects”/],
        ['effects=glossy:off:off', /“effects”/],
        [`solo=${Array(17).fill('a').join()}`, /“solo”.*at most 16/],
        ['solo=a,b%20c', /“solo”/],
        ['scale=cubic', /“scale”.*log, linear/],
        ['min=1e13', /“min”/],
        ['min=0', /“min”.*above 0/],
        ['max=0', /“max”.*above 0/],
        ['scale=linear&max=0', /“max”.*above 0/],
        ['scale=linear&min=5&max=5', /“min”.*less than “max”/],
        ['smooth=1', /“smooth”.*true or false/],
        ['colour=red', /“colour” of the link is not known/],
        [`${'k'.repeat(99)}=1`, /^“k{32}” of the link is not known$/],
        ['tone=agx&tone=aces', /“tone”.*given once/],
        ['fov=180', /“fov”.*1 to 179/],
    ];
    for (const [end, why] of bad) {
        const { pose, refused } = read(`${end}&eye=0,1,3&at=0,1,0`);
        assert.equal(refused.length, 1, `${end}: ${refused.join('; ')}`);
        assert.match(refused[0]!, why, end);
        assert.deepEqual(pose?.position, [0, 1, 3], end);
    }
    for (const [end, field] of [['eye=0,1', 'eye'], ['eye=0,1,2', 'at'], ['at=0,1,2', 'eye'], ['eye=1,1,1&at=1,1,1', 'at'], ['eye=0,0,1e10&at=0,0,0', 'eye'], ['eye=0,0,Infinity&at=0,0,0', 'eye'], ['eye=1e9,0,0&at=999999999.999,0,0', 'eye']] as const) {
        const { pose, refused } = read(end);
        assert.equal(pose, null, end);
        assert.ok(refused.some((r) => r.includes(`“${field}”`)), `${end}: ${refused.join('; ')}`);
    }
    assert.match(sharedIn('#view=2&tone=aces', KNOWN)!.refused[0]!, /“view”/);
    assert.match(sharedIn(`#view=1&solo=${'a'.repeat(5000)}`, KNOWN)!.refused[0]!, /longer than 4096/);
    assert.ok(sharedIn('#view=1&tone=%', KNOWN)!.refused.length > 0, 'what is no text is no error of the page');
});

test('an up without a direction is upwards', () => {
    assert.deepEqual(read('eye=0,1,3&at=0,1,0&up=0,0,0').pose?.up, [0, 1, 0]);
});

test('an address has the project and the view, and nothing else of that of the page', () => {
    assert.equal(linkTo({ origin: 'https://a.example', pathname: '/light/' }, 'k3v9q2x7m4ab', 'view=1&ev=8'), 'https://a.example/light/?project=k3v9q2x7m4ab#view=1&ev=8');
    assert.equal(linkTo({ origin: 'https://a.example', pathname: '/' }, '', 'view=1'), 'https://a.example/#view=1');
});

test('a page shows once what it was called for, says what is no good, and never has a token in a link', async () => {
    const shown: unknown[] = [];
    const said: string[] = [];
    let forgot = 0;
    let copied = '';
    let refuses = false;
    const page = { hash: '#t=secret&view=1&tone=aces&ev=99', origin: 'http://x', pathname: '/', forget: () => forgot++, write: (text: string) => (refuses ? Promise.reject(new Error('no')) : Promise.resolve(void (copied = text))) };
    const sharing = new Sharing({
        ...{ pose: () => POSE, settings: () => SETTINGS, project: () => '', known: () => KNOWN, show: (...all) => shown.push(all), onRefused: (text) => said.push(text), announce: () => undefined },
        page,
    });
    assert.ok(sharing.waits);
    assert.equal(sharing.apply(), false, 'it has no camera');
    assert.deepEqual([shown, forgot, sharing.apply()], [[[null, { toneMap: 'aces' }]], 1, false]);
    assert.match(said.join(), /“ev”/);
    assert.ok(sharing.called(`#${fragmentOf(POSE, PLAIN)}`));
    assert.equal(sharing.apply(), true);
    await sharing.copy();
    assert.equal(copied, sharing.link());
    assert.equal(sharing.byHand.value, null);
    assert.ok(!copied.includes('secret') && !/[#&?]t=/.test(copied), copied);
    refuses = true;
    await sharing.copy();
    assert.equal(sharing.byHand.value, copied, 'it can be copied by hand');
});
