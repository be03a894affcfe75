import type { Scale } from '../lib/scale';
import { NumberField } from './NumberField';
import { Slider } from './Slider';

interface Props {
    label: string;
    value: number;
    unit: string;
    /** What the number may be; the slider's ends are its scale's. */
    limits: readonly [number, number];
    scale: Scale;
    /** Positions of the slider that its keys move by. */
    steps?: { arrow: number; page: number };
    spoken: string;
    disabled: boolean;
    /** Room for a number of many digits, or a long unit. */
    wide?: boolean;
    describedBy?: string;
    /** Of a running gesture. */
    onInput(value: number): void;
    /** A number was typed. */
    onCommit(value: number): void;
    onEnd(): void;
}

const STEPS = { arrow: 0.01, page: 0.1 };

/** A name, a slider and a number in a line. */
export function Dial({ label, value, unit, limits, scale, steps, spoken, disabled, wide, describedBy, onInput, onCommit, onEnd }: Props) {
    return (
        <div class={`dial ${wide ? 'is-wide' : ''}`}>
            <span class="field-label" aria-hidden="true">
                {label}
            </span>
            <Slider label={label} scale={scale} value={value} steps={steps ?? STEPS} spoken={spoken} disabled={disabled} describedBy={describedBy} onInput={onInput} onEnd={onEnd} />
            <NumberField label={label} value={value} unit={unit} min={limits[0]} max={limits[1]} onCommit={onCommit} />
        </div>
    );
}
