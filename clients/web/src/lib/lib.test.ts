import assert from 'node:assert/strict';
import { test } from 'node:test';
import { cctToLinear, linearFromHex, linearFromXy, luminance, planckianXy, swatch, unitLuminance, xyOf } from './colour';
import { limit, number, percent, si, toError } from './format';
import { parseQuantity } from './quantity';
import { kelvinScale, linearScale, logScale } from './scale';
import { RateWindow } from './window';

test('a black body at 2856 K is CIE illuminant A', () => {
    const [x, y] = planckianXy(2856);
    // The fit is stated to be within 0.001 of the locus in xy.
    assert.ok(Math.abs(x - 0.44757) < 1e-3 && Math.abs(y - 0.40745) < 1e-3, `${x} ${y}`);
});

test('the three pieces of the locus meet', () => {
    for (const k of [2222, 4000]) {
        const below = planckianXy(k - 1e-6);
        const above = planckianXy(k + 1e-6);
        // The published coefficients leave a step of at most 2e-4 at the joints.
        below.forEach((v, i) => assert.ok(Math.abs(v - above[i]!) < 2e-4, `${k} K: ${v} and ${above[i]}`));
    }
});

test('light of any temperature has luminance 1, and warm light is redder', () => {
    // Under 1900 K blue is clamped away, which adds luminance. The weights have four digits, the matrix seven: 0.2126 against
    // 0.2126729 with red up to 2.6 is 1.9e-4.
    for (const k of [1950, 2700, 4000, 6504, 20000]) assert.ok(Math.abs(luminance(cctToLinear(k)) - 1) < 2e-4, `${k} K`);
    const warm = cctToLinear(2700);
    const cool = cctToLinear(12000);
    assert.ok(warm[0] / warm[2] > 4 && cool[2] > cool[0]);
    assert.ok(cctToLinear(100).every((v) => v >= 0 && Number.isFinite(v)));
});

test('a picked colour survives the way to unit luminance and back to the screen', () => {
    for (const hex of ['#ff8040', '#00ff00', '#ffffff', '#123456']) {
        const colour = unitLuminance(linearFromHex(hex));
        assert.ok(Math.abs(luminance(colour) - 1) < 1e-12);
        // A swatch is scaled to full brightness; its hue must be that of the picked colour at full brightness.
        assert.equal(swatch(colour), swatch(linearFromHex(hex)));
    }
    assert.equal(swatch(linearFromHex('#ff8040')), '#ff8040');
    assert.equal(swatch([0, 0, 0]), '#000000');
    assert.deepEqual(unitLuminance([0, 0, 0]), [1, 1, 1]);
});

test('the intensity slider: zero at the left, even in decades, inverse within its three digits', () => {
    const s = logScale(1, 100000);
    assert.equal(s.toValue(0), 0);
    assert.equal(s.toPosition(0), 0);
    assert.equal(s.toValue(1), 100000);
    assert.equal(s.toValue(0.6), 1000);
    for (let p = 0.05; p <= 1; p += 0.01) {
        // Three digits: half a unit of the third is 0.5 % at most.
        assert.ok(Math.abs(s.toPosition(s.toValue(p)) - p) <= 0.005 / Math.log(100000), String(p));
    }
    assert.equal(s.toPosition(1e9), 1);
});

test('the kelvin slider is even in mired', () => {
    const s = kelvinScale(2000, 10000);
    assert.equal(s.toValue(0), 2000);
    assert.equal(s.toValue(1), 10000);
    assert.equal(s.toValue(0.5), Math.round(1e6 / 300 / 10) * 10);
    assert.ok(Math.abs(s.toPosition(3330) - 0.5) < 1e-2);
});

test('a linear slider may run from high to low', () => {
    const s = linearScale(18, -4, 10);
    assert.equal(s.toValue(0), 18);
    assert.equal(s.toValue(1), -4);
    assert.equal(s.toPosition(7), 0.5);
});

test('numbers for people', () => {
    assert.equal(number(12345), '12\u2009350');
    assert.equal(number(0.5), '0.5');
    assert.equal(si(21300000), '21.3 M');
    assert.equal(si(0), '0 ');
    assert.deepEqual([toError(125.34, 4.7), toError(1253, 96), toError(0.5, 0)], [125, 1300, 0.5]);
    assert.equal(percent(0.0123), '1.2 %');
    assert.deepEqual([-1e9, 1e12, 0, 0.001, 3600].map(limit), ['−10⁹', '10¹²', '0', '0.001', '3\u2009600']);
});

test('a rate falls to zero when nothing comes any more', () => {
    const w = new RateWindow(1000);
    for (let t = 0; t < 1000; t += 100) w.push(t, 5);
    assert.equal(w.rate(999), 50);
    assert.equal(w.rate(5000), 0);
});

test('chromaticities and linear colours are two ways to say the same, and what a screen cannot show is told', () => {
    // The primaries of Rec. 709 and its white, D65.
    const near = (a: readonly number[], b: readonly number[]): void => a.forEach((v, i) => assert.ok(Math.abs(v - b[i]!) < 2e-4, `${a} and ${b}`));
    near(xyOf([1, 0, 0]), [0.64, 0.33]);
    near(xyOf([0, 1, 0]), [0.3, 0.6]);
    near(xyOf([0, 0, 1]), [0.15, 0.06]);
    near(xyOf([5, 5, 5]), [0.3127, 0.329]);
    for (const [x, y] of [[0.3127, 0.329], [0.45, 0.41], [0.25, 0.2], [0.55, 0.35]] as const) {
        const { linear, outside } = linearFromXy(x, y);
        assert.ok(!outside && Math.abs(luminance(linear) - 1) < 1e-6);
        near(xyOf(linear), [x, y]);
    }
    const red = linearFromXy(0.7, 0.29);
    assert.ok(red.outside && Math.min(...red.linear) >= 0 && Math.abs(luminance(red.linear) - 1) < 1e-6);
});

test('numbers are read as people type them', () => {
    const read = (text: string, unit: string): unknown => {
        const q = parseQuantity(text, unit);
        return q && [q.value, q.unit];
    };
    assert.deepEqual(read(' 2,5 ', 'm'), [2.5, 'm']);
    assert.deepEqual(read('80 cm', 'm'), [0.8, 'm']);
    assert.deepEqual(read('1\u2009200 lm', 'lm'), [1200, 'lm']);
    assert.deepEqual(read('1.2klm', '×'), [1200, 'lm']);
    assert.deepEqual(read('50 %', 'lm'), [50, '%']);
    assert.deepEqual(read('−15°', '°'), [-15, '°']);
    assert.deepEqual(read('200 DALI', 'lm'), [200, 'dali']);
    assert.deepEqual(read('1e3', 'lx'), [1000, 'lx']);
    assert.deepEqual(read('0,125', 'm'), [0.125, 'm']);
    for (const no of ['', 'm', '1,200', '1.2.3', '--1']) assert.equal(read(no, 'm'), null, no);
});
