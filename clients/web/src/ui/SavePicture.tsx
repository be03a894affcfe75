import { useSignal } from '@preact/signals';
import { number, percent } from '../lib/format';
import { PANORAMA_WIDTHS, type StillFormat } from '../state/stills';
import { Choice } from './Choice';
import { useApp } from './context';

const FORMATS: [StillFormat, string][] = [
    ['png', 'PNG, as shown'],
    ['exr', 'EXR, in cd/m²'],
];

/** The picture as a file: what is on screen, or all around from where its camera stands. */
export function SavePicture() {
    const app = useApp();
    const { stills } = app;
    const format = useSignal<StillFormat>('png');
    const width = useSignal<number>(PANORAMA_WIDTHS[0]);
    const idle = stills.progress.value === null;
    const savePicture = (): void => {
        const now = app.shotOf('now');
        if (format.value === 'exr') void stills.start('picture', 'exr', 0);
        else if (now) app.downloads.picture({ ...now, name: 'picture' });
    };
    return (
        <div class="save-picture" role="group" aria-label="Save the picture">
            <div class="choices">
                <Choice label="Save as" value={format.value} options={FORMATS} onChange={(f) => (format.value = f as StillFormat)} />
                <Choice
                    label="Panorama’s size"
                    value={String(width.value)}
                    options={PANORAMA_WIDTHS.map((w): [string, string] => [String(w), `${w} × ${w / 2}`])}
                    onChange={(w) => (width.value = Number(w))}
                />
            </div>
            {idle ? (
                <div class="actions">
                    <button type="button" class="button" onClick={savePicture}>
                        Save picture
                    </button>
                    <button type="button" class="button" title="All around, from where the camera stands, for viewers of 360° pictures" onClick={() => void stills.start('panorama', format.value, width.value)}>
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
                <button type="button" class="button" onClick={() => stills.cancel()}>
                    Cancel
                </button>
            </div>
        </>
    );
}
