interface ChoiceProps {
    label: string;
    value: string;
    options: [string, string][];
    /** What an option means, where its name does not say it. */
    titles?: ReadonlyMap<string, string>;
    onChange(value: string): void;
}

/** A list to choose from, under its name. */
export function Choice({ label, value, options, titles, onChange }: ChoiceProps) {
    const known = options.some(([key]) => key === value);
    return (
        <label class="choice">
            <span class="field-label">{label}</span>
            <select
                value={value}
                title={titles?.get(value)}
                onChange={(e) => onChange(e.currentTarget.value)}
            >
                {!known && <option value={value}>{value || 'default'}</option>}
                {options.map(([key, name]) => (
                    <option key={key} value={key} title={titles?.get(key)}>
                        {name}
                    </option>
                ))}
            </select>
        </label>
    );
}
