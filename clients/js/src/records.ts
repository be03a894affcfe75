/**
 * Types of a scene's records and of frame.stats, with units, and what may be asked. Written from protocol/PROTOCOL.md by
 * records_from_protocol.py: change the tables there.
 */

export interface Texture {
    /** the picture */
    image: string;
    /** 2 uv; -1e6 to 1e6; default 0 0; as KHR_texture_transform */
    offset?: readonly [number, number];
    /** 2; -1e6 to 1e6; default 1 1 */
    scale?: readonly [number, number];
    /** rad; -1e6 to 1e6; default 0; counter-clockwise about the uv origin */
    rotation_rad?: number;
    /** default repeat */
    wrap_u?: 'repeat' | 'mirror' | 'clamp';
    /** default repeat */
    wrap_v?: 'repeat' | 'mirror' | 'clamp';
}

export interface Transform {
    /** 3 m; -1e9 to 1e9; default 0 0 0; applied last */
    translate?: readonly [number, number, number];
    /** 3 deg; -1e6 to 1e6; default 0 0 0; about X first, then Y, then Z */
    rotate_deg?: readonly [number, number, number];
    /** 3; -1e6 to 1e6; default 1 1 1; applied first; no factor may be 0 */
    scale?: readonly [number, number, number];
}

export interface Web {
    /** of maker and luminaire, as the file says */
    name?: string | null;
    /** default c; of photometry, as LM-63 has it */
    type?: 'c' | 'b' | 'a';
    /** deg; -360 to 720; see PROTOCOL.md */
    c_deg: readonly number[];
    /** deg; 0 to 180; see PROTOCOL.md */
    gamma_deg: readonly number[];
    /** cd; 0 to 1e12; of each plane, all angles; linear between angles */
    candela: readonly number[];
    /** default point; shape that shines */
    opening?: 'point' | 'rectangle' | 'disc' | 'sphere';
    /** 3 m; 0 to 1e6; default 0 0 0; of the opening: along c 0, along c 90, height */
    size?: readonly [number, number, number];
    /** lm; 0 to 1e12; of its lamps, as the file says; null: absolute photometry */
    rated_lm?: number | null;
    /** W; 0 to 1e9; it takes; null: the file does not say */
    watts?: number | null;
}

export interface Box {
    /** 3 m; -1e9 to 1e9 */
    min: readonly [number, number, number];
    /** 3 m; -1e9 to 1e9 */
    max: readonly [number, number, number];
}

export interface Lamps {
    /** a light, or an object that shines */
    id: string;
    /** default true */
    on?: boolean;
    /** lm; 0 to 1e12 */
    flux_lm?: number | null;
    /** cd; 0 to 1e12 */
    intensity_cd?: number | null;
    /** cd/m2; 0 to 1e12 */
    luminance_cd_m2?: number | null;
    /** lx; 0 to 1e12 */
    illuminance_lx?: number | null;
    /** 0 to 1e6; one of these five at most; none: as its file, material, or place and time make it */
    multiplier?: number | null;
    /** 3; 0 to 1e6; linear; excludes cct_k. Neither: white, or its material's */
    color?: readonly [number, number, number] | null;
    /** K; 1667 to 25000; correlated colour temperature */
    cct_k?: number | null;
}

export interface Mesh {
    /** default empty; a built-in shape; empty: the arrays below */
    shape?: string;
    /** 3 m; 0 to 1e9; default 1 1 1; of a shape: edges of its box */
    size?: readonly [number, number, number];
    /** 2; 0 to 2048; default 0 0; of a shape: tessellation around and along; 0: its default */
    segments?: readonly [number, number];
    /** 4; -1e9 to 1e9; default 0 0 0 0; of a shape: its own knobs; 0: its default */
    param?: readonly [number, number, number, number];
    /** m; -1e9 to 1e9; x, y, z of each vertex */
    positions?: readonly number[] | null;
    /** three vertices of each triangle, counter-clockwise from the front */
    indices?: readonly number[] | null;
    /** -1e6 to 1e6; per vertex; none: flat shading */
    normals?: readonly number[] | null;
    /** uv; -1e6 to 1e6; per vertex */
    uvs?: readonly number[] | null;
    /** -1e6 to 1e6; see PROTOCOL.md */
    tangents?: readonly number[] | null;
    /** 0 to 1e6; per vertex, linear; multiply base_color */
    colors?: readonly number[] | null;
    /** default false; positions will be set again: the index structure is refitted, not rebuilt */
    deforming?: boolean;
}

export interface Image {
    /** PNG, JPEG, HDR or EXR below the asset root; excludes pixels */
    asset?: string | null;
    /** px; 0 to 16384; default 0; of pixels */
    width?: number;
    /** px; 0 to 16384; default 0; of pixels */
    height?: number;
    /** default srgb8; 4 bytes RGBA, or 3 little-endian floats RGB */
    texel?: 'srgb8' | 'linear8' | 'rgb32f';
    /** base64, rows from the top; excludes asset */
    pixels?: string | null;
}

export interface Material {
    /** 3; 0 to 1; default 1 1 1; linear */
    base_color?: readonly [number, number, number];
    /** sRGB, multiplies base_color; its alpha multiplies alpha */
    base_color_texture?: Texture | null;
    /** 0 to 1; default 0 */
    metallic?: number;
    /** 0 to 1; default 1; GGX alpha = roughness^2; 0: a mirror */
    roughness?: number;
    /** G multiplies roughness, B metallic */
    metallic_roughness_texture?: Texture | null;
    /** tangent space */
    normal_texture?: Texture | null;
    /** -100 to 100; default 1 */
    normal_scale?: number;
    /** 1 to 4; default 1.5; index of refraction */
    ior?: number;
    /** 0 to 1; default 1; scales the dielectric reflection; 0: purely diffuse */
    specular?: number;
    /** alpha multiplies specular */
    specular_texture?: Texture | null;
    /** 3; 0 to 100; default 1 1 1 */
    specular_color?: readonly [number, number, number];
    /** sRGB, multiplies specular_color */
    specular_color_texture?: Texture | null;
    /** 0 to 1; default 0; share of light that passes through */
    transmission?: number;
    /** R multiplies transmission */
    transmission_texture?: Texture | null;
    /** 3; 0 to 1; default 0 0 0; of paper, cloth, opal: what leaves the far side evenly; with base_color at most 1 */
    diffuse_transmittance?: readonly [number, number, number];
    /** alpha multiplies diffuse_transmittance */
    diffuse_transmission_texture?: Texture | null;
    /** 0 to 0.999; default 0; with that texture at alpha a the base reflects base_color * (1 - share * a) / (1 - share) */
    diffuse_transmission_share?: number;
    /** 3; 0 to 1; default 0 0 0; of the fuzz of cloth, seen where the surface turns away */
    sheen_color?: readonly [number, number, number];
    /** 0 to 1; default 0; of that; below 0.27 it is as at 0.27 */
    sheen_roughness?: number;
    /** 0 to 1; default 0; how much of a clear lacquer lies over all of it */
    clearcoat?: number;
    /** 0 to 1; default 0; of that: GGX alpha = clearcoat_roughness^2; 0: a mirror */
    clearcoat_roughness?: number;
    /** R multiplies clearcoat */
    clearcoat_texture?: Texture | null;
    /** G multiplies clearcoat_roughness; with it a coat is nowhere a mirror */
    clearcoat_roughness_texture?: Texture | null;
    /** tangent space, of the coat alone */
    clearcoat_normal_texture?: Texture | null;
    /** -100 to 100; default 1 */
    clearcoat_normal_scale?: number;
    /** 0 to 1; default 0; brushed: how far highlights are stretched; 1: alpha along the stretch is 1 */
    anisotropy?: number;
    /** deg; -3600 to 3600; default 0; of the stretch: 0 along +u, 90 along -v of uv */
    anisotropy_rotation_deg?: number;
    /** see PROTOCOL.md */
    anisotropy_texture?: Texture | null;
    /** default false; a surface without volume: transmission does not bend */
    thin?: boolean;
    /** 3; 0 to 1; default 1 1 1; what is left after attenuation_distance */
    attenuation_color?: readonly [number, number, number];
    /** m; 1e-09 to 1e9; null: clear */
    attenuation_distance?: number | null;
    /** 3; 0 to 1e6; default 1 1 1; normalised to luminance 1 */
    emission_color?: readonly [number, number, number];
    /** sRGB, multiplies emission */
    emission_texture?: Texture | null;
    /** cd/m2; 0 to 1e12; default 0; emitted luminance */
    emission_cd_m2?: number;
    /** default both; which shine; front: around which the triangles wind */
    emission_sides?: 'both' | 'front';
    /** default opaque */
    alpha_mode?: 'opaque' | 'mask' | 'blend';
    /** 0 to 1; default 1 */
    alpha?: number;
    /** 0 to 1; default 0.5; mask: less is invisible */
    alpha_cutoff?: number;
    /** default false; shown as base_color, reflects nothing */
    unlit?: boolean;
}

export interface Object {
    mesh: string;
    material: string;
    /** default identity; mesh to world; must be invertible */
    transform?: Transform | readonly number[];
    /** default true */
    visible?: boolean;
    /** default true; false: it gives no light */
    on?: boolean;
    /** lm; 0 to 1e12; all light that leaves it; null: as its material says */
    flux_lm?: number | null;
    /** cd/m2; 0 to 1e12; emitted luminance; null: as its material says */
    luminance_cd_m2?: number | null;
    /** 3; 0 to 1e6; of its light: linear, normalised to luminance 1; null: its material's; excludes cct_k */
    color?: readonly [number, number, number] | null;
    /** K; 1667 to 25000; correlated colour temperature of its light; excludes color */
    cct_k?: number | null;
    /** mixing group of its light; null: its own id */
    group?: string | null;
}

export interface Light {
    kind: 'point' | 'spot' | 'ies' | 'directional' | 'quad' | 'disc' | 'sphere' | 'environment' | 'sky' | 'sun';
    /** 3 m; -1e9 to 1e9; default 0 0 0; centre */
    position?: readonly [number, number, number];
    /** 3; -1e9 to 1e9; default 0 -1 0; spot, ies, directional, disc: where light goes */
    direction?: readonly [number, number, number];
    /** deg; -3600 to 3600; default 0; see PROTOCOL.md */
    roll_deg?: number;
    /** 3 m; -1e9 to 1e9; default 1 0 0; quad: full edge; it emits towards u x v */
    u?: readonly [number, number, number];
    /** 3 m; -1e9 to 1e9; default 0 0 1; quad: full edge */
    v?: readonly [number, number, number];
    /** m; 0 to 1e9; default 0.1; disc, sphere */
    radius?: number;
    /** deg; 0 to 90; default 0; see PROTOCOL.md */
    diameter_deg?: number;
    /** deg; 0 to 90; default 0; spot: half angle of full intensity */
    inner_cone_deg?: number;
    /** deg; 0.01 to 90; default 45; spot: half angle where it ends */
    outer_cone_deg?: number;
    /** lm; 0 to 1e12; point, spot, ies, quad, disc, sphere: all that it emits */
    flux_lm?: number | null;
    /** cd; 0 to 1e12; point, spot */
    intensity_cd?: number | null;
    /** cd/m2; 0 to 1e12; quad, disc, sphere, environment, sky: of a sky: at its zenith */
    luminance_cd_m2?: number | null;
    /** lx; 0 to 1e12; directional, sky, sun: on a facing plane; of a sky: on the open horizontal plane */
    illuminance_lx?: number | null;
    /** 0 to 1e6; ies: of the intensities of its web; null, and no flux_lm: 1 */
    multiplier?: number | null;
    /** ies: IES LM-63 or EULUMDAT file below the asset root; excludes web */
    asset?: string | null;
    /** ies: what such a file says; excludes asset */
    web?: Web | null;
    /** 3; 0 to 1e6; default 1 1 1; linear, normalised to luminance 1 when used; excludes cct_k */
    color?: readonly [number, number, number];
    /** K; 1667 to 25000; correlated colour temperature; excludes color */
    cct_k?: number | null;
    /** environment: equirectangular picture, scaled by luminance_cd_m2 */
    image?: string | null;
    /** deg; -3600 to 3600; default 0; environment: about +Y */
    rotation_deg?: number;
    /** 1 to 16; default 12; sky: CIE general sky; 16: the traditional overcast one */
    cie_type?: number;
    /** 0 to 1; default 0.2; sky: of what lies below the horizon, lit by the sky alone */
    ground_albedo?: number;
    /** default empty; sun: YYYY-MM-DD, of the place's calendar */
    date?: string;
    /** h; 0 to 24; default 12; sun: of the place's clock: 13.5 is half past one */
    time_h?: number;
    /** h; -14 to 14; default 0; sun: by which that clock is ahead of UTC */
    utc_offset_h?: number;
    /** deg; -90 to 90; default 0; sun: north is positive */
    latitude_deg?: number;
    /** deg; -180 to 180; default 0; sun: east is positive */
    longitude_deg?: number;
    /** deg; -360 to 360; default 0; sun: of north from -Z, towards +X */
    north_deg?: number;
    /** deg; 0 to 360; sun: from north by east; with elevation_deg, in place of place and time */
    azimuth_deg?: number | null;
    /** deg; -90 to 90; sun: over the horizon; with azimuth_deg */
    elevation_deg?: number | null;
    /** 0 to 10; default 0.21; sun: of the air, towards the zenith, where illuminance_lx is null */
    extinction?: number;
    /** mixing group; null: its own id */
    group?: string | null;
    /** default true */
    on?: boolean;
    /** default true; ies, quad, disc, sphere, environment, sky: seen directly */
    camera_visible?: boolean;
    /** default false; ies: shines from its centre, whatever opening its web has */
    as_point?: boolean;
}

export interface Medium {
    /** 3 1/m; 0 to 1e6; default 0 0 0; scattering */
    sigma_s?: readonly [number, number, number];
    /** 3 1/m; 0 to 1e6; default 0 0 0; absorption */
    sigma_a?: readonly [number, number, number];
    /** -0.99 to 0.99; default 0; Henyey-Greenstein asymmetry */
    g?: number;
    /** where it is; null: everywhere */
    box?: Box | null;
}

export interface Sensor {
    /** where it measures; observer: glare */
    kind: 'point' | 'line' | 'grid' | 'observer';
    /** default plane; point, line, grid: which illuminance; or glare of eyes there */
    quantity?: 'plane' | 'cylindrical' | 'semicylindrical' | 'modelling' | 'ugr';
    /** 3 m; -1e9 to 1e9; the point; the middle of a line or grid; the eye */
    position: readonly [number, number, number];
    /** 3 m; -1e9 to 1e9; default 1 0 0; line, grid: full edge */
    u?: readonly [number, number, number];
    /** 3 m; -1e9 to 1e9; default 0 0 1; grid: full edge */
    v?: readonly [number, number, number];
    /** 3; -1e9 to 1e9; default 0 1 0; see PROTOCOL.md */
    normal?: readonly [number, number, number];
    /** 3; -1e9 to 1e9; default 0 0 -1; line of sight of an observer, and the first of eyes (ugr); where a half cylinder faces */
    direction?: readonly [number, number, number];
    /** 1 to 64; default 8; point, line, grid: ugr: lines of sight of each eye, evenly around the vertical */
    directions?: number;
    /** m; 1e-06 to 1e9; line, grid: between points, at most; null: by EN 12464-1 */
    spacing_m?: number | null;
    /** m2; 1e-06 to 1e+18; grid: of the room, over which power is told; null: the grid's own area */
    floor_m2?: number | null;
    /** lx; 1e-06 to 1e9; point, line, grid: mean that is wanted, at least */
    target_lx?: number | null;
    /** 1e-06 to 1; line, grid: least over mean, at least */
    target_uo?: number | null;
    /** 1e-06 to 100; point, line, grid, observer: at most; else with quantity ugr alone */
    target_ugr?: number | null;
    /** 1e-06 to 1; observer: at most */
    target_dgp?: number | null;
    /** for people */
    name?: string | null;
}

export interface Patch {
    /** default sacn */
    protocol?: 'sacn' | 'artnet';
    /** 0 to 63999; default 1; sacn: 1 to 63999; artnet: the port address, 0 to 32767 */
    universe?: number;
    /** 1 to 512; default 1; of its first channel */
    address?: number;
    /** default dim; from there on; 16: two a value, the coarse one first */
    channels?: 'dim' | 'dim16' | 'rgb' | 'rgb16';
    /** default linear; see PROTOCOL.md */
    curve?: 'linear' | 'square' | 'dali';
    /** a light, an object or a mixing group, there when it is set */
    target: string;
}

export interface Preset {
    /** for people */
    name?: string | null;
    /** -1e6 to 1e6; default 0; where it stands among the others: less comes first, then by id */
    order?: number;
    /** s; 0 to 3600; default 0; that a recall takes which says nothing else; 0: at once */
    fade_s?: number;
    /** that it changes; all others stay as they are */
    lamps?: readonly Lamps[] | null;
}

export interface Camera {
    /** 3 m; -1e9 to 1e9 */
    position: readonly [number, number, number];
    /** 3 m; -1e9 to 1e9; looked at */
    target: readonly [number, number, number];
    /** 3; -1e9 to 1e9; default 0 1 0; not parallel to the view direction */
    up?: readonly [number, number, number];
    /** deg; 1 to 179; default 45; vertical field of view, of a perspective */
    vfov_deg?: number;
    /** default perspective; panorama: all around, up at the upper edge */
    projection?: 'perspective' | 'panorama';
}

export interface Render {
    /** default live; default of views; see lumend methods */
    method?: string;
    /** 0 to 65536; default 1024; samples per pixel at which a resting picture stops; 0: never */
    spp?: number;
    /** 0 to 64; default 64; path segments after the first hit; roulette ends nearly all before */
    max_depth?: number;
    /** 1 to 16; default 16; per area light and pixel in deferred methods: 1, 4, 9 or 16 */
    shadow_samples?: number;
    /** 0 to 4294967295; default 0 */
    seed?: number;
    /** 1 to 65536; default 256; see PROTOCOL.md */
    vpls?: number;
    /** 0.01 to 1; default 0.2; error that records of a cache may have: less is finer and slower */
    cache_accuracy?: number;
    /** default true; smooth edges of surfaces and, in live, of hard shadows; false: rays through pixel centres */
    antialias?: boolean;
    /** EV100; -30 to 30; higher is darker; null: automatic */
    exposure_ev?: number | null;
    /** default agx */
    tone_map?: 'agx' | 'aces' | 'reinhard' | 'none';
    /** default physical; see PROTOCOL.md */
    glass?: 'physical' | 'architectural';
    /** of views that name none, there when it is set; null, or gone: main, else the first by id */
    camera?: string | null;
}

export interface Import {
    /** model file below the asset root */
    asset: string;
    /** default identity; model to world; must be invertible */
    transform?: Transform | readonly number[];
}

/** What can be added, by its type. */
export interface Added {
    mesh: Mesh;
    image: Image;
    material: Material;
    object: Object;
    light: Light;
    medium: Medium;
    sensor: Sensor;
    patch: Patch;
    preset: Preset;
    camera: Camera;
}

/** All types of records. */
export interface Records {
    mesh: Mesh;
    image: Image;
    material: Material;
    object: Object;
    light: Light;
    medium: Medium;
    sensor: Sensor;
    patch: Patch;
    preset: Preset;
    camera: Camera;
    render: Render;
    import: Import;
}

export interface FrameStats {
    /** number of the frame, from 0. Of a view it is frame_seq - 1 */
    frame: number;
    /** revision of the scene that the frame shows */
    scene_rev: number;
    /** ms; time that its passes took */
    ms: number;
    /** ms; CPU time of the worker threads in these passes */
    cpu_ms: number;
    /** number of passes; those that only measure the error of a picture that rests do not count */
    passes: number;
    /** samples per pixel; see PROTOCOL.md */
    spp: number;
    /** ms; time of each stage of the passes, below */
    stage_ms: {
        /** first hits: what each pixel sees */
        gbuffer: number;
        /** material and normal at the first hits */
        surfaces: number;
        /** virtual point lights, of methods that share none */
        vpls: number;
        /** virtual point lights of the shared cache, and what an edit makes stale in it */
        cache: number;
        /** records of indirect light */
        records: number;
        /** shadow rays: point, spot and directional light, in some methods of all lamps */
        direct: number;
        /** soft shadows and environment light, first samples */
        shadow: number;
        /** more samples where shadows have edges */
        refine: number;
        /** indirect light at each pixel, from records or virtual point lights */
        indirect: number;
        /** mirrors and glass */
        specular: number;
        /** gloss */
        glossy: number;
        /** fog */
        media: number;
        /** smooths samples along surfaces */
        filter: number;
        /** from fewer pixels to all */
        upsample: number;
        /** path traced samples */
        path: number;
        /** sum over lights and effects */
        composite: number;
        /** smooth edges */
        antialias: number;
        /** probes: how far the picture is off */
        error: number;
    };
    /** rays; traced, by what for, below */
    rays: {
        /** from the eye to the first hit */
        primary: number;
        /** for the effect of this name, as are all below but the last two */
        direct: number;
        soft_shadow: number;
        environment: number;
        indirect_diffuse: number;
        reflection: number;
        transmission: number;
        glossy: number;
        media: number;
        scattering: number;
        antialias: number;
        /** to place virtual point lights */
        vpl: number;
        /** of the probes that tell the error */
        probe: number;
    };
    /** each effect, below */
    effects: Record<string, {
        /** boolean; it is called for, by the scene or by the view's effects */
        on: boolean;
        /** text; what in the scene calls for it, or why nothing does */
        why: string;
        /** boolean; the method computes it. False where on is true: the picture lacks it */
        served: boolean;
        /** rays; traced for it; exactly 0 where it is off, as the next two */
        rays: number;
        /** tiles; blocks of 16 x 16 pixels in which rays were traced for it, added up over stages and passes */
        tiles: number;
        /** ns; see PROTOCOL.md */
        ns: number;
        /** ratio; see PROTOCOL.md */
        noise: number | null;
    }>;
    /** records of indirect light that all views of the same settings share; all 0 of methods that keep none */
    cache: {
        /** records; there are now */
        records: number;
        /** records; made where none served */
        created: number;
        /** records; brought up to date after an edit */
        updated: number;
        /** records; used as they were */
        reused: number;
        /** records; taken out */
        removed: number;
        /** records; made by two threads at once, and thrown away */
        discarded: number;
    };
    /** virtual point lights: where light of the lamps meets surfaces, and shines from there */
    vpls: {
        /** that shine */
        count: number;
        /** of these, those that are not where they were in the pass before */
        moved: number;
    };
    /** light that mirrors and solid glass focus and that is in no picture, below; null: not measured yet */
    caustics: {
        /** ratio; of focused_lm in arriving_lm, of all such lamps */
        share: number;
        /** ratio; standard error of share */
        stderr: number;
        /** lm; that reach surfaces by way of mirrors or solid glass */
        focused_lm: number;
        /** lm; that such lamps bring to surfaces at all */
        arriving_lm: number;
        /** text; the same in words; empty below 0.5 % */
        why: string;
        /** text; what can be done about it; empty below 0.5 % */
        mend: string;
        /** revision that it was measured at */
        scene_rev: number;
        /** rays; see PROTOCOL.md */
        rays: number;
        /** the lamps with most of it, eight at most */
        lights: readonly {
            /** id; the lamp */
            id: string;
            /** id; that mirrors or bends most of it */
            object: string;
            /** ratio; as above, of this lamp; likewise the next three */
            share: number;
            /** ratio */
            stderr: number;
            /** lm */
            focused_lm: number;
            /** lm */
            arriving_lm: number;
        }[];
    } | null;
    /** samples; that were infinite or not a number, and were left out. Not 0: please report it */
    nonfinite: number;
    /** rays; that were not finite, and were not traced. Not 0: please report it */
    bad_rays: number;
    /** ratio; see PROTOCOL.md */
    culled_bound: number;
    /** see PROTOCOL.md */
    error: {
        /** ratio; root mean square error over mean luminance: an estimate. 0 where there is none to be told from noise */
        rel: number;
        /** ratio; see PROTOCOL.md */
        bound: number;
        /** pixels; of this picture, that the estimate is made from */
        probes: number;
        /** ratio; see PROTOCOL.md */
        fresh: number;
    } | null;
    /** ms; time of all passes since the picture began */
    spent_ms: number;
    /** name; see PROTOCOL.md */
    stopped_by: string | null;
    /** name; see PROTOCOL.md */
    budget_verdict: string | null;
    /** see PROTOCOL.md */
    predicted: {
        /** name; the most likely one */
        stopped_by: string;
        /** ms; spent_ms then */
        ms: number;
        /** ms; the soonest: errors fall no faster than 1 / samples */
        ms_least: number;
        /** ms; see PROTOCOL.md */
        ms_most: number | null;
        /** ratio; error.bound then; where it ends by a budget's error, that; null: not known */
        error: number | null;
        /** ratio; the least that it may be; null: not known */
        error_least: number | null;
        /** ratio; the most that it may be; null: not known */
        error_most: number | null;
    } | null;
    /** the view */
    view_id: number;
    /** number of the frame, as in its tiles; acknowledge it */
    frame_seq: number;
    /** that the client gave to the camera that the frame shows; 0: none */
    camera_seq: number;
    /** name; that rendered it */
    method: string;
    /** EV100; exposure of the picture, also where it is automatic */
    exposure_ev: number;
    /** ms; time that tone mapping and encoding took */
    encode_ms: number;
    /** ms; see PROTOCOL.md */
    server_ms: number;
    /** tiles; encoded anew. The others show what they showed */
    tiles: number;
    /** bytes; of these tiles, headers included */
    bytes: number;
    /** name; of these tiles */
    codec: string;
    /** of these tiles, as quality of the view; 100 of exact ones */
    quality: number;
    /** bytes per second; see PROTOCOL.md */
    line_bytes_s: number | null;
    /** boolean; the picture shows the map that the view's overlay asks for */
    overlay_map: boolean;
    /** object; with such a map, but of shapes: what its colours stand for */
    overlay?: {
        /** name; what its limits are in: cd/m2, lx, relative (1: 100 %), times refined */
        unit: string;
        /** numbers; between its classes, rising; where it is smooth, round values to name */
        limits: readonly number[];
        /** #rrggbb; of the classes: one more than limits; where it is smooth, evenly from min to max */
        colors: readonly string[];
        /** name; of false colour: log or linear */
        scale: string;
        /** boolean; of false colour: colours change evenly */
        smooth: boolean;
        /** of its unit; of false colour: lower end of the scale; what is below has its colour */
        min: number;
        /** of its unit; of false colour: upper end, likewise */
        max: number;
        /** lists of x, y, value; of false colour with lines: pixels where a line's value can be written without covering another */
        labels: readonly (readonly number[])[];
    };
    /** name; see PROTOCOL.md */
    in_view: string;
    /** boolean; the picture is final. Nothing more comes until something changes */
    converged: boolean;
    /** see PROTOCOL.md */
    budget_chose: {
        /** pixels; see PROTOCOL.md */
        blocks: number;
        /** name; see PROTOCOL.md */
        eased: string | null;
        /** ms; that its first pass was expected to take, by what passes took before; null: nothing was known */
        ms: number | null;
    } | null;
}

export type Method =
    | 'session.hello'
    | 'scene.get'
    | 'view.open'
    | 'view.update'
    | 'view.close'
    | 'view.read'
    | 'frame.ack'
    | 'pick'
    | 'surroundings'
    | 'bounds'
    | 'photometry'
    | 'daylight'
    | 'stats.get'
    | 'timeline.get'
    | 'presence.set'
    | 'project.list'
    | 'version.list'
    | 'probe'
    | 'sensor.watch'
    | 'sensor.read'
    | 'sensor.place'
    | 'report.get'
    | 'scene.apply'
    | 'scene.undo'
    | 'scene.redo'
    | 'scene.revert'
    | 'timeline.name'
    | 'scene.export'
    | 'preset.store'
    | 'preset.recall'
    | 'preset.stop'
    | 'asset.list'
    | 'asset.photometry'
    | 'asset.upload'
    | 'project.create'
    | 'project.rename'
    | 'project.delete'
    | 'project.restore'
    | 'project.erase'
    | 'trash.empty'
    | 'version.keep'
    | 'version.remove'
    | 'session.list'
    | 'session.end';

/** What requests take, as the examples of PROTOCOL.md have it, where messages.ts says no more. */
export interface ParamsByExample {
    'view.close': { view_id: number };
    surroundings: { view_id: number };
    bounds: { id: string };
    'timeline.name': { scene_rev: number; name: string };
    'scene.export': Record<string, never>;
    'asset.upload': { files: readonly { name: string; bytes: number }[] };
    'trash.empty': Record<string, never>;
    'version.keep': { project: string; name: string };
    'session.end': { session: string };
}

/** What they are answered. */
export interface AnswersByExample {
    'view.close': Record<string, never>;
    surroundings: { enclosed: number; reach: number };
    bounds: { min: readonly [number, number, number]; max: readonly [number, number, number] };
    'timeline.name': Record<string, never>;
    'scene.export': { get: string; bytes: number; scene_rev: number };
    'asset.upload': { put: string };
    'trash.empty': { erased: number };
    'version.keep': { version: string };
    'session.end': Record<string, never>;
}
