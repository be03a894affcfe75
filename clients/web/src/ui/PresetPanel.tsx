import { useSignal } from '@preact/signals';
import type { SceneRecord } from '../protocol/types';
import { MOST_FADE_S, MOST_NAME_BYTES, nameOf } from '../state/presets';
import { useApp } from './context';
import { Editing } from './Editing';
import { NumberField } from './NumberField';

/** Looks of the room's light: a button for each. */
export function PresetPanel() {
    const { presets } = useApp();
    const list = presets.list.value;
    const fading = presets.fading.value;
    return (
        <section class="section" aria-labelledby="presets-title">
            <Editing>
                <header class="section-head">
                    <h2 id="presets-title">Presets</h2>
                    {fading && (
                        <button type="button" class="toggle at-end" onClick={() => presets.stop()}>
                            Stop the fade
                        </button>
                    )}
                </header>
                {list.length === 0 && <p class="hint">A preset keeps brightness, colour and on or off of all lamps, to come back to them by a crossfade.</p>}
                {list.length > 0 && (
                    <>
                        <ul class="looks">
                            {list.map((preset) => (
                                <Look key={preset.id} preset={preset} />
                            ))}
                        </ul>
                        <NumberField label="Crossfade" unit="s" min={0} max={MOST_FADE_S} step={0.5} value={presets.fadeS.value} onCommit={(v) => (presets.fadeS.value = v)} />
                    </>
                )}
                <Store />
            </Editing>
        </section>
    );
}

function Store() {
    const { presets } = useApp();
    const name = useSignal('');
    const store = async (): Promise<void> => {
        const wanted = name.value.trim() || `Preset ${presets.list.value.length + 1}`;
        if (await presets.store(wanted)) name.value = '';
    };
    return (
        <form
            class="look-store"
            onSubmit={(e) => {
                e.preventDefault();
                void store();
            }}
        >
            <input
                type="text"
                aria-label="Name of a new preset"
                placeholder="Name, like Evening"
                maxLength={MOST_NAME_BYTES}
                value={name.value}
                onInput={(e) => (name.value = e.currentTarget.value)}
            />
            <button type="submit" class="button">
                Store
            </button>
        </form>
    );
}

function Look({ preset }: { preset: SceneRecord }) {
    const { presets } = useApp();
    const open = useSignal(false);
    const name = nameOf(preset);
    const fading = presets.fading.value;
    const list = presets.list.value;
    return (
        <li>
            <div class="look-row">
                <button type="button" class="look" aria-pressed={presets.last.value === preset.id} onClick={() => presets.recall(preset)}>
                    {name}
                    {fading?.id === preset.id && <span key={fading.count} class="look-progress" style={{ animationDuration: `${fading.fadeS}s` }} aria-hidden="true" />}
                </button>
                <button type="button" class="toggle is-quiet" aria-expanded={open.value} aria-label={`Change ${name}`} onClick={() => (open.value = !open.value)}>
                    …
                </button>
            </div>
            {open.value && (
                <div class="look-more">
                    <input
                        type="text"
                        aria-label={`Name of ${name}`}
                        maxLength={MOST_NAME_BYTES}
                        value={name}
                        onChange={(e) => presets.rename(preset, e.currentTarget.value.trim())}
                    />
                    <button type="button" class="button" onClick={() => void presets.update(preset)}>
                        Update
                    </button>
                    <button type="button" class="button" disabled={list[0]?.id === preset.id} onClick={() => presets.move(preset, -1)}>
                        Up
                    </button>
                    <button type="button" class="button" disabled={list[list.length - 1]?.id === preset.id} onClick={() => presets.move(preset, 1)}>
                        Down
                    </button>
                    <button type="button" class="button" onClick={() => presets.remove(preset)}>
                        Delete
                    </button>
                </div>
            )}
        </li>
    );
}
