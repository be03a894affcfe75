/** "models/Big Room.glb" -> "big-room", made unique among the ids that exist. */
export function idForAsset(asset: string, taken: (id: string) => boolean): string {
    const file = asset.split('/').pop() ?? '';
    const stem = file.replace(/\.[^.]*$/, '').toLowerCase();
    const id = stem.replace(/[^a-z0-9_.-]+/g, '-').replace(/^-+|-+$/g, '').slice(0, 40) || 'import';
    let name = id;
    for (let n = 2; taken(name); n++) name = `${id}-${n}`;
    return name;
}
