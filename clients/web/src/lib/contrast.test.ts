import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { linearFromHex, luminance } from './colour';

/** Tests run from the client's folder. */
const css = readFileSync('src/style/tokens.css', 'utf8');

function tokens(selector: string): Map<string, string> {
    const block = css.slice(css.indexOf(`${selector} {`)).split('}')[0]!;
    const long = (hex: string): string => (hex.length === 4 ? `#${Array.from(hex.slice(1), (c) => c + c).join('')}` : hex);
    return new Map([...block.matchAll(/--([\w-]+): (#[0-9a-f]{3,6});/g)].map((m) => [m[1]!, long(m[2]!)]));
}

/** WCAG 2.2: relative luminances, each with 5 % of flare. */
function contrast(a: string, b: string): number {
    const [x, y] = [luminance(linearFromHex(a)), luminance(linearFromHex(b))];
    return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
}

const dark = tokens(':root');
const themes = { dark, contrast: new Map([...dark, ...tokens("[data-theme='contrast']")]) };
const SURFACES = ['bg', 'panel', 'raised'];

for (const [name, theme] of Object.entries(themes)) {
    test(`theme ${name}: text has a contrast of 4.5, and what shows a control of 3`, () => {
        const check = (inks: string[], least: number): void => {
            for (const ink of inks)
                for (const surface of SURFACES) {
                    const c = contrast(theme.get(ink)!, theme.get(surface)!);
                    assert.ok(c >= least, `--${ink} on --${surface}: ${c.toFixed(2)}`);
                }
        };
        check(['text', 'dim', 'faint', 'accent', 'info', 'good', 'bad'], 4.5);
        check(['line-strong', 'track', 'focus'], 3);
        assert.ok(contrast(theme.get('on-accent')!, theme.get('accent')!) >= 4.5);
    });
}
