import { polarPath, type Polar as Curves } from '../state/luminaires';

/** Intensity by direction: down is where the lamp aims. Solid: the plane through C 0 and C 180, dashed: C 90 and C 270. */
export function Polar({ polar, label }: { polar: Curves | null; label?: string }) {
    const named = label ? { role: 'img' as const, 'aria-label': label } : { 'aria-hidden': true as const };
    return (
        <svg class="polar" viewBox="-1.06 -1.06 2.12 2.12" {...named}>
            <circle class="polar-grid" r="1" />
            <circle class="polar-grid" r="0.5" />
            <path class="polar-grid" d="M-1 0H1M0-1V1" />
            {polar && <path class="polar-c90" d={polarPath(polar, 'c90')} />}
            {polar && <path class="polar-c0" d={polarPath(polar, 'c0')} />}
        </svg>
    );
}
