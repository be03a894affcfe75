import { useRef } from 'preact/hooks';
import { hexOf, linearFromHex, luminance, unitLuminance } from '../lib/colour';
import { number } from '../lib/format';
import { linearScale, logScale, type Scale } from '../lib/scale';
import type { Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import type { SceneRecord } from '../protocol/types';
import { amountOf, baseFor, colourOf, hasHaze, hazeOf, lightOf, roughnessFor, sheetFor, within, type Part } from '../state/material';
import { useApp } from './context';
import { Dial } from './Dial';
import { NumberField } from './NumberField';

const SHARE = linearScale(0, 1, 100);
const PERCENT = linearScale(0, 100, 2);
const IOR = linearScale(1, 2.5, 100);
const TURN = linearScale(-90, 90, 1);
const TURN_STEPS = { arrow: 1 / 180, page: 15 / 180 };
const GLOW = logScale(1, 100_000);

const thousandth = (v: number): number => Math.round(1e3 * v) / 1e3;
const tenth = (share: number): number => Math.round(1e3 * share) / 10;

interface FieldProps {
    m: SceneRecord;
}

interface AmountProps extends FieldProps {
    field: string;
    label: string;
    /** 0 to 1 where it is not said. */
    scale?: Scale;
    limits?: readonly [number, number];
    unit?: string;
    spokenUnit?: string;
    steps?: { arrow: number; page: number };
    wide?: boolean;
}

/** A number of the record as it is. */
function Amount({ m, field, label, scale = SHARE, limits = [0, 1], unit = '', spokenUnit = '', steps, wide = false }: AmountProps) {
    const { edits, mayEdit } = useApp();
    const value = thousandth(amountOf(m, field));
    return (
        <Dial
            {...{ label, value, unit, limits, scale, wide, disabled: !mayEdit.value }}
            {...(steps ? { steps } : {})}
            spoken={`${number(value)} ${spokenUnit}`.trim()}
            onInput={(v) => edits.set(m.id, `/${field}`, v)}
            onCommit={(v) => edits.setOnce(m.id, `/${field}`, v)}
            onEnd={() => edits.endGesture()}
        />
    );
}

interface ColourProps extends FieldProps {
    label: string;
    colour: Vec3;
    field: string;
    /** What the field becomes when a colour of the screen is chosen. */
    from?(c: Vec3): Vec3;
}

function ColourField({ m, label, colour, field, from = (c) => c }: ColourProps) {
    const { edits } = useApp();
    return (
        <label class="picker">
            <span class="field-label">{label}</span>
            <input
                type="color"
                value={hexOf(colour)}
                onInput={(e) => edits.set(m.id, `/${field}`, [...from(linearFromHex(e.currentTarget.value))] as Json)}
                onChange={() => edits.endGesture()}
            />
        </label>
    );
}

/** How much it reflects, of which colour: what a planner knows of a surface. */
export function BaseFields({ m }: FieldProps) {
    const { edits, mayEdit } = useApp();
    const base = colourOf(m, 'base_color');
    // Black has no hue: it comes back as it was before.
    const hue = useRef({ id: '', colour: base });
    if (luminance(base) > 1e-3 || hue.current.id !== m.id) hue.current = { id: m.id, colour: base };
    const { rho } = lightOf(m);
    const colourAt = (percent: number): Json => [...baseFor(m, percent / 100, hue.current.colour)];
    return (
        <>
            <Dial
                label="Reflectance ρ"
                value={tenth(rho)}
                unit="%"
                limits={[0, 100]}
                scale={PERCENT}
                spoken={`${number(tenth(rho))} percent`}
                disabled={!mayEdit.value}
                describedBy="rho-is"
                onInput={(v) => edits.set(m.id, '/base_color', colourAt(v))}
                onCommit={(v) => edits.setOnce(m.id, '/base_color', colourAt(v))}
                onEnd={() => edits.endGesture()}
            />
            <ColourField m={m} label="Colour" colour={base} field="base_color" from={(c) => within(c, colourOf(m, 'diffuse_transmittance'))} />
            <Amount m={m} field="roughness" label="Roughness" />
            <Amount m={m} field="specular" label="Gloss" />
            <Amount m={m} field="metallic" label="Metal" />
        </>
    );
}

export const PART_NAMES: Record<Part, string> = {
    lacquer: 'Lacquer',
    brushed: 'Brushed',
    glass: 'Glass',
    sheet: 'Translucent',
    cloth: 'Cloth',
    glow: 'Emission',
};

export function PartFields({ m, part }: FieldProps & { part: Part }) {
    switch (part) {
        case 'lacquer':
            return (
                <>
                    <Amount m={m} field="clearcoat" label="Lacquer" />
                    <Amount m={m} field="clearcoat_roughness" label="Its roughness" />
                </>
            );
        case 'brushed':
            return (
                <>
                    <Amount m={m} field="anisotropy" label="Stretch" />
                    <Amount m={m} field="anisotropy_rotation_deg" label="Direction" scale={TURN} limits={[-3600, 3600]} unit="°" spokenUnit="degrees" steps={TURN_STEPS} />
                </>
            );
        case 'glass':
            return <Glass m={m} />;
        case 'sheet':
            return <Sheet m={m} />;
        case 'cloth':
            return (
                <>
                    <ColourField m={m} label="Fuzz" colour={colourOf(m, 'sheen_color')} field="sheen_color" />
                    <Amount m={m} field="sheen_roughness" label="Its roughness" />
                </>
            );
        case 'glow':
            return (
                <>
                    <Amount m={m} field="emission_cd_m2" label="Luminance" scale={GLOW} limits={[0, 1e12]} unit="cd/m²" spokenUnit="candela per square metre" wide />
                    <ColourField m={m} label="Its colour" colour={shownGlow(colourOf(m, 'emission_color'))} field="emission_color" from={unitLuminance} />
                </>
            );
    }
}

/** Of luminance 1 most are brighter than the screen. */
const shownGlow = (c: Vec3): Vec3 => {
    const top = Math.max(...c, 1e-9);
    return [c[0] / top, c[1] / top, c[2] / top];
};

function Glass({ m }: FieldProps) {
    const { edits } = useApp();
    const thin = m.thin === true;
    const distance = m.attenuation_distance;
    return (
        <>
            <Amount m={m} field="transmission" label="Glass" />
            <Amount m={m} field="ior" label="Index n" scale={IOR} limits={[1, 4]} />
            <label class="switch-line">
                <input type="checkbox" checked={thin} onChange={(e) => edits.setOnce(m.id, '/thin', e.currentTarget.checked)} />
                <span>Thin pane: it bends nothing</span>
            </label>
            {hasHaze(m) && <Haze m={m} />}
            {!thin && (
                <>
                    <ColourField m={m} label="Tint inside" colour={colourOf(m, 'attenuation_color')} field="attenuation_color" />
                    <NumberField
                        label="Thickness that has it (0: clear)"
                        value={typeof distance === 'number' ? distance : 0}
                        unit="m"
                        min={0}
                        max={1e9}
                        onCommit={(v) => edits.setOnce(m.id, '/attenuation_distance', v > 0 ? Math.max(v, 1e-9) : null)}
                    />
                </>
            )}
        </>
    );
}

/** Of what a thin pane lets through, as its data sheet has it. */
function Haze({ m }: FieldProps) {
    const { edits, mayEdit } = useApp();
    const value = tenth(hazeOf(m));
    const at = (percent: number): Json => roughnessFor(m, percent / 100);
    return (
        <Dial
            label="Haze"
            value={value}
            unit="%"
            limits={[0, 100]}
            scale={PERCENT}
            spoken={`${number(value)} percent`}
            disabled={!mayEdit.value}
            onInput={(v) => edits.set(m.id, '/roughness', at(v))}
            onCommit={(v) => edits.setOnce(m.id, '/roughness', at(v))}
            onEnd={() => edits.endGesture()}
        />
    );
}

function Sheet({ m }: FieldProps) {
    const { edits, mayEdit } = useApp();
    const tau = lightOf({ ...m, transmission: 0 }).tau;
    const at = (percent: number): Json => [...sheetFor(m, percent / 100)];
    return (
        <>
            <Dial
                label="Transmittance τ"
                value={tenth(tau)}
                unit="%"
                limits={[0, 100]}
                scale={PERCENT}
                spoken={`${number(tenth(tau))} percent`}
                disabled={!mayEdit.value}
                onInput={(v) => edits.set(m.id, '/diffuse_transmittance', at(v))}
                onCommit={(v) => edits.setOnce(m.id, '/diffuse_transmittance', at(v))}
                onEnd={() => edits.endGesture()}
            />
            <ColourField
                m={m}
                label="Colour"
                colour={colourOf(m, 'diffuse_transmittance')}
                field="diffuse_transmittance"
                from={(c) => within(c, colourOf(m, 'base_color'))}
            />
        </>
    );
}
