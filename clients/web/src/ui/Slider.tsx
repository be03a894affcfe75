import type { Scale } from '../lib/scale';

interface Props {
    label: string;
    scale: Scale;
    value: number;
    /** What assistive technology says, as "800 lumens". */
    spoken: string;
    class?: string;
    onInput(value: number): void;
    /** The pointer let go, or a key press is over. */
    onEnd(): void;
}

export function Slider({ label, scale, value, spoken, class: extra, onInput, onEnd }: Props) {
    const position = scale.toPosition(value);
    return (
        <input
            type="range"
            class={`slider ${extra ?? ''}`}
            min="0"
            max="1"
            step="0.001"
            value={position}
            aria-label={label}
            aria-valuetext={spoken}
            style={{ '--fill': `${(100 * position).toFixed(1)}%` }}
            onInput={(e) => onInput(scale.toValue(e.currentTarget.valueAsNumber))}
            onChange={onEnd}
        />
    );
}
