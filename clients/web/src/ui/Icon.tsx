/** Line icons on a 20-unit grid, drawn in the current text colour. */

const PATHS = {
    undo: 'M7.5 4 4 7.5 7.5 11M4.5 7.5H12a4 4 0 0 1 0 8H8',
    redo: 'M12.5 4 16 7.5 12.5 11M15.5 7.5H8a4 4 0 0 0 0 8h4',
    frame: 'M3.5 7V3.5H7M13 3.5h3.5V7M16.5 13v3.5H13M7 16.5H3.5V13M8 10h4M10 8v4',
    home: 'M3.5 9.5 10 4l6.5 5.5M5.5 8.5v7.5h9V8.5',
    help: 'M7.6 7.4a2.4 2.4 0 1 1 3.6 2.1c-.8.5-1.2 1-1.2 2M10 14.6v.1',
    contrast: 'M10 3.2a6.8 6.8 0 1 0 0 13.6zM10 3.2a6.8 6.8 0 0 1 0 13.6',
    lamp: 'M7.6 13.2c0-1.6-2.1-2.6-2.1-5.2a4.5 4.5 0 0 1 9 0c0 2.6-2.1 3.6-2.1 5.2zM8 16.5h4',
    close: 'm5.5 5.5 9 9m0-9-9 9',
    save: 'M10 3.5v9M6.5 9.2 10 12.7l3.5-3.5M4 16.5h12',
    model: 'm10 3 6 3v8l-6 3-6-3V6l6 3 6-3M10 9v8',
    snap: 'M4 7.5h12M4 12.5h12M7.5 4v12M12.5 4v12',
    plus: 'M10 4.5v11M4.5 10h11',
} as const;

export function Icon({ name }: { name: keyof typeof PATHS }) {
    return (
        <svg class="icon" viewBox="0 0 20 20" aria-hidden="true" focusable="false">
            <path d={PATHS[name]} />
        </svg>
    );
}
