import { useSignal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { number, percent } from '../lib/format';
import { isUnseen } from '../state/lights';
import { PANORAMA_WIDTHS, type StillFormat, type StillKind } from '../state/stills';
import { Choice } from './Choice';
import { useApp } from './context';

const FORMATS: [StillFormat, string][] = [
    ['png', 'PNG, as shown'],
    ['exr', 'EXR, in cd/m²'],
];

const BUTTONS: Record<StillKind, string> = { picture: '.save-picture-now', panorama: '.save-panorama' };

/** The picture as a file: what is on screen, or all around from where its camera stands. */
export function SavePicture() {
    const app = useApp();
    const { stills } = app;
    const format = useSignal<StillFormat>('png');
    const width = useSignal<number>(PANORAMA_WIDTHS[0]);
    const idle = stills.progress.value === null;
    const unseen = app.scene.list('light').value.filter((id) => isUnseen(app.scene.record(id))).length;
    const group = useRef<HTMLDivElement>(null);
    const begun = useRef<StillKind | null>(null);
    const start = (kind: StillKind): void => {
        begun.current = kind;
        void stills.start(kind, format.value, width.value);
    };
    const savePicture = (): void => {
        const now = app.shotOf('now');
        if (format.value === 'exr') start('picture');
        else if (now) app.downloads.picture({ ...now, name: 'picture' });
    };
    // The button that was pressed makes room for others, and comes back: whoever is at it is taken along, nobody else.
    useLayoutEffect(() => {
        if (begun.current === null || document.activeElement !== document.body) return;
        group.current?.querySelector<HTMLElement>(idle ? BUTTONS[begun.current] : '.save-cancel')?.focus();
    }, [idle]);
    return (
        <div ref={group} class="save-picture" role="group" aria-label="Save the picture">
            <div class="choices">
                <Choice label="Save as" value={format.value} options={FORMATS} onChange={(f) => (format.value = f as StillFormat)} />
                <Choice
                    label="Panorama’s size"
                    value={String(width.value)}
                    options={PANORAMA_WIDTHS.map((w): [string, string] => [String(w), `${w} × ${w / 2}`])}
                    onChange={(w) => (width.value = Number(w))}
                />
            </div>
            {unseen > 0 && (
                <p class="hint">
                    {unseen === 1 ? 'A lamp without an extent is' : `${number(unseen)} lamps without an extent are`} in no picture: light at the eye, summed up from a panorama, lacks
                    theirs.
                </p>
            )}
            {idle ? (
                <div class="actions">
                    <button type="button" class="button save-picture-now" disabled={format.value === 'exr' && !app.online.value} onClick={savePicture}>
                        Save picture
                    </button>
                    <button
                        type="button"
                        class="button save-panorama"
                        title="All around, from where the camera stands, for viewers of 360° pictures"
                        disabled={!app.online.value}
                        onClick={() => start('panorama')}
                    >
                        Save panorama
                    </button>
                </div>
            ) : (
                <Progress />
            )}
        </div>
    );
}

function Progress() {
    const { stills } = useApp();
    const now = stills.progress.value;
    if (!now) return null;
    const error = now.error === null ? '' : `, ±${percent(now.error)}`;
    return (
        <>
            <p class="hint" aria-live="off">
                The {now.kind} is made: {now.spp > 0 ? `${number(now.spp)} ${now.spp === 1 ? 'sample' : 'samples'} per pixel${error}` : 'it begins'}
            </p>
            <div class="actions">
                <button type="button" class="button" disabled={now.spp === 0} onClick={() => void stills.save()}>
                    Save it as it is
                </button>
                <button type="button" class="button save-cancel" onClick={() => stills.cancel()}>
                    Cancel
                </button>
            </div>
        </>
    );
}
