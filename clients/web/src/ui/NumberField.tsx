interface Props {
    label: string;
    value: number;
    unit: string;
    min?: number;
    step?: number;
    onCommit(value: number): void;
}

/** Takes effect on Enter or when left; what is not a number falls back to the value before. */
export function NumberField({ label, value, unit, min, step, onCommit }: Props) {
    const commit = (input: HTMLInputElement): void => {
        const v = input.valueAsNumber;
        if (Number.isFinite(v) && v >= (min ?? -Infinity) && v !== value) onCommit(v);
        else input.value = String(value);
    };
    return (
        <label class="number">
            <span class="number-label">{label}</span>
            <input
                type="number"
                aria-label={label}
                value={value}
                min={min}
                step={step ?? 'any'}
                onBlur={(e) => commit(e.currentTarget)}
                onKeyDown={(e) => {
                    if (e.key === 'Enter') commit(e.currentTarget);
                }}
            />
            <span class="number-unit" aria-hidden="true">
                {unit}
            </span>
        </label>
    );
}
