"""Types of a scene's records and their fields, with units. Written from protocol/PROTOCOL.md by
records_from_protocol.py: change the tables there."""
from typing import Literal, Required, Sequence, TypedDict, Unpack


class Texture(TypedDict, total=False):
    image: Required[str]  # the picture
    offset: Sequence[float]  # 2 uv; -1e6 to 1e6; default 0 0; as KHR_texture_transform
    scale: Sequence[float]  # 2; -1e6 to 1e6; default 1 1
    rotation_rad: float  # rad; -1e6 to 1e6; default 0; counter-clockwise about the uv origin
    wrap_u: Literal["repeat", "mirror", "clamp"]  # default repeat
    wrap_v: Literal["repeat", "mirror", "clamp"]  # default repeat


class Transform(TypedDict, total=False):
    translate: Sequence[float]  # 3 m; -1e9 to 1e9; default 0 0 0; applied last
    rotate_deg: Sequence[float]  # 3 deg; -1e6 to 1e6; default 0 0 0; about X first, then Y, then Z
    scale: Sequence[float]  # 3; -1e6 to 1e6; default 1 1 1; applied first; no factor may be 0


class Web(TypedDict, total=False):
    name: str | None  # of maker and luminaire, as the file says
    type: Literal["c", "b", "a"]  # default c; of photometry, as LM-63 has it
    c_deg: Required[Sequence[float]]  # deg; -360 to 720; see PROTOCOL.md
    gamma_deg: Required[Sequence[float]]  # deg; 0 to 180; see PROTOCOL.md
    candela: Required[Sequence[float]]  # cd; 0 to 1e12; of each plane, all angles; linear between angles
    opening: Literal["point", "rectangle", "disc", "sphere"]  # default point; shape that shines
    size: Sequence[float]  # 3 m; 0 to 1e6; default 0 0 0; of the opening: along c 0, along c 90, height
    rated_lm: float | None  # lm; 0 to 1e12; of its lamps, as the file says; null: absolute photometry
    watts: float | None  # W; 0 to 1e9; it takes; null: the file does not say


class Box(TypedDict, total=False):
    min: Required[Sequence[float]]  # 3 m; -1e9 to 1e9
    max: Required[Sequence[float]]  # 3 m; -1e9 to 1e9


class Lamps(TypedDict, total=False):
    id: Required[str]  # a light, or an object that shines
    on: bool  # default true
    flux_lm: float | None  # lm; 0 to 1e12
    intensity_cd: float | None  # cd; 0 to 1e12
    luminance_cd_m2: float | None  # cd/m2; 0 to 1e12
    illuminance_lx: float | None  # lx; 0 to 1e12
    multiplier: float | None  # 0 to 1e6; one of these five at most; none: as its file, material, or place and time make it
    color: Sequence[float] | None  # 3; 0 to 1e6; linear; excludes cct_k. Neither: white, or its material's
    cct_k: float | None  # K; 1667 to 25000; correlated colour temperature


class Mesh(TypedDict, total=False):
    shape: str  # default empty; a built-in shape; empty: the arrays below
    size: Sequence[float]  # 3 m; 0 to 1e9; default 1 1 1; of a shape: edges of its box
    segments: Sequence[int]  # 2; 0 to 2048; default 0 0; of a shape: tessellation around and along; 0: its default
    param: Sequence[float]  # 4; -1e9 to 1e9; default 0 0 0 0; of a shape: its own knobs; 0: its default
    positions: Sequence[float] | None  # m; -1e9 to 1e9; x, y, z of each vertex
    indices: Sequence[int] | None  # three vertices of each triangle, counter-clockwise from the front
    normals: Sequence[float] | None  # -1e6 to 1e6; per vertex; none: flat shading
    uvs: Sequence[float] | None  # uv; -1e6 to 1e6; per vertex
    tangents: Sequence[float] | None  # -1e6 to 1e6; see PROTOCOL.md
    colors: Sequence[float] | None  # 0 to 1e6; per vertex, linear; multiply base_color
    deforming: bool  # default false; positions will be set again: the index structure is refitted, not rebuilt


class Image(TypedDict, total=False):
    asset: str | None  # PNG, JPEG, HDR or EXR below the asset root; excludes pixels
    width: int  # px; 0 to 16384; default 0; of pixels
    height: int  # px; 0 to 16384; default 0; of pixels
    texel: Literal["srgb8", "linear8", "rgb32f"]  # default srgb8; 4 bytes RGBA, or 3 little-endian floats RGB
    pixels: str | None  # base64, rows from the top; excludes asset


class Material(TypedDict, total=False):
    base_color: Sequence[float]  # 3; 0 to 1; default 1 1 1; linear
    base_color_texture: Texture | None  # sRGB, multiplies base_color; its alpha multiplies alpha
    metallic: float  # 0 to 1; default 0
    roughness: float  # 0 to 1; default 1; GGX alpha = roughness^2; 0: a mirror
    metallic_roughness_texture: Texture | None  # G multiplies roughness, B metallic
    normal_texture: Texture | None  # tangent space
    normal_scale: float  # -100 to 100; default 1
    ior: float  # 1 to 4; default 1.5; index of refraction
    specular: float  # 0 to 1; default 1; scales the dielectric reflection; 0: purely diffuse
    specular_texture: Texture | None  # alpha multiplies specular
    specular_color: Sequence[float]  # 3; 0 to 100; default 1 1 1
    specular_color_texture: Texture | None  # sRGB, multiplies specular_color
    transmission: float  # 0 to 1; default 0; share of light that passes through
    transmission_texture: Texture | None  # R multiplies transmission
    diffuse_transmittance: Sequence[float]  # 3; 0 to 1; default 0 0 0; of paper, cloth, opal: what leaves the far side evenly; with base_color at most 1
    diffuse_transmission_texture: Texture | None  # alpha multiplies diffuse_transmittance
    diffuse_transmission_share: float  # 0 to 0.999; default 0; with that texture at alpha a the base reflects base_color * (1 - share * a) / (1 - share)
    sheen_color: Sequence[float]  # 3; 0 to 1; default 0 0 0; of the fuzz of cloth, seen where the surface turns away
    sheen_roughness: float  # 0 to 1; default 0; of that; below 0.27 it is as at 0.27
    clearcoat: float  # 0 to 1; default 0; how much of a clear lacquer lies over all of it
    clearcoat_roughness: float  # 0 to 1; default 0; of that: GGX alpha = clearcoat_roughness^2; 0: a mirror
    clearcoat_texture: Texture | None  # R multiplies clearcoat
    clearcoat_roughness_texture: Texture | None  # G multiplies clearcoat_roughness; with it a coat is nowhere a mirror
    clearcoat_normal_texture: Texture | None  # tangent space, of the coat alone
    clearcoat_normal_scale: float  # -100 to 100; default 1
    anisotropy: float  # 0 to 1; default 0; brushed: how far highlights are stretched; 1: alpha along the stretch is 1
    anisotropy_rotation_deg: float  # deg; -3600 to 3600; default 0; of the stretch: 0 along +u, 90 along -v of uv
    anisotropy_texture: Texture | None  # see PROTOCOL.md
    thin: bool  # default false; a surface without volume: transmission does not bend
    attenuation_color: Sequence[float]  # 3; 0 to 1; default 1 1 1; what is left after attenuation_distance
    attenuation_distance: float | None  # m; 1e-09 to 1e9; null: clear
    emission_color: Sequence[float]  # 3; 0 to 1e6; default 1 1 1; normalised to luminance 1
    emission_texture: Texture | None  # sRGB, multiplies emission
    emission_cd_m2: float  # cd/m2; 0 to 1e12; default 0; emitted luminance
    emission_sides: Literal["both", "front"]  # default both; which shine; front: around which the triangles wind
    alpha_mode: Literal["opaque", "mask", "blend"]  # default opaque
    alpha: float  # 0 to 1; default 1
    alpha_cutoff: float  # 0 to 1; default 0.5; mask: less is invisible
    unlit: bool  # default false; shown as base_color, reflects nothing


class Object(TypedDict, total=False):
    mesh: Required[str]
    material: Required[str]
    transform: Transform | Sequence[float]  # default identity; mesh to world; must be invertible
    visible: bool  # default true
    on: bool  # default true; false: it gives no light
    flux_lm: float | None  # lm; 0 to 1e12; all light that leaves it; null: as its material says
    luminance_cd_m2: float | None  # cd/m2; 0 to 1e12; emitted luminance; null: as its material says
    color: Sequence[float] | None  # 3; 0 to 1e6; of its light: linear, normalised to luminance 1; null: its material's; excludes cct_k
    cct_k: float | None  # K; 1667 to 25000; correlated colour temperature of its light; excludes color
    group: str | None  # mixing group of its light; null: its own id


class Light(TypedDict, total=False):
    kind: Required[Literal["point", "spot", "ies", "directional", "quad", "disc", "sphere", "environment", "sky", "sun"]]
    position: Sequence[float]  # 3 m; -1e9 to 1e9; default 0 0 0; centre
    direction: Sequence[float]  # 3; -1e9 to 1e9; default 0 -1 0; spot, ies, directional, disc: where light goes
    roll_deg: float  # deg; -3600 to 3600; default 0; see PROTOCOL.md
    u: Sequence[float]  # 3 m; -1e9 to 1e9; default 1 0 0; quad: full edge; it emits towards u x v
    v: Sequence[float]  # 3 m; -1e9 to 1e9; default 0 0 1; quad: full edge
    radius: float  # m; 0 to 1e9; default 0.1; disc, sphere
    diameter_deg: float  # deg; 0 to 90; default 0; see PROTOCOL.md
    inner_cone_deg: float  # deg; 0 to 90; default 0; spot: half angle of full intensity
    outer_cone_deg: float  # deg; 0.01 to 90; default 45; spot: half angle where it ends
    flux_lm: float | None  # lm; 0 to 1e12; point, spot, ies, quad, disc, sphere: all that it emits
    intensity_cd: float | None  # cd; 0 to 1e12; point, spot
    luminance_cd_m2: float | None  # cd/m2; 0 to 1e12; quad, disc, sphere, environment, sky: of a sky: at its zenith
    illuminance_lx: float | None  # lx; 0 to 1e12; directional, sky, sun: on a facing plane; of a sky: on the open horizontal plane
    multiplier: float | None  # 0 to 1e6; ies: of the intensities of its web; null, and no flux_lm: 1
    asset: str | None  # ies: IES LM-63 or EULUMDAT file below the asset root; excludes web
    web: Web | None  # ies: what such a file says; excludes asset
    color: Sequence[float]  # 3; 0 to 1e6; default 1 1 1; linear, normalised to luminance 1 when used; excludes cct_k
    cct_k: float | None  # K; 1667 to 25000; correlated colour temperature; excludes color
    image: str | None  # environment: equirectangular picture, scaled by luminance_cd_m2
    rotation_deg: float  # deg; -3600 to 3600; default 0; environment: about +Y
    cie_type: int  # 1 to 16; default 12; sky: CIE general sky; 16: the traditional overcast one
    ground_albedo: float  # 0 to 1; default 0.2; sky: of what lies below the horizon, lit by the sky alone
    date: str  # default empty; sun: YYYY-MM-DD, of the place's calendar
    time_h: float  # h; 0 to 24; default 12; sun: of the place's clock: 13.5 is half past one
    utc_offset_h: float  # h; -14 to 14; default 0; sun: by which that clock is ahead of UTC
    latitude_deg: float  # deg; -90 to 90; default 0; sun: north is positive
    longitude_deg: float  # deg; -180 to 180; default 0; sun: east is positive
    north_deg: float  # deg; -360 to 360; default 0; sun: of north from -Z, towards +X
    azimuth_deg: float | None  # deg; 0 to 360; sun: from north by east; with elevation_deg, in place of place and time
    elevation_deg: float | None  # deg; -90 to 90; sun: over the horizon; with azimuth_deg
    extinction: float  # 0 to 10; default 0.21; sun: of the air, towards the zenith, where illuminance_lx is null
    group: str | None  # mixing group; null: its own id
    on: bool  # default true
    camera_visible: bool  # default true; ies, quad, disc, sphere, environment, sky: seen directly
    as_point: bool  # default false; ies: shines from its centre, whatever opening its web has


class Medium(TypedDict, total=False):
    sigma_s: Sequence[float]  # 3 1/m; 0 to 1e6; default 0 0 0; scattering
    sigma_a: Sequence[float]  # 3 1/m; 0 to 1e6; default 0 0 0; absorption
    g: float  # -0.99 to 0.99; default 0; Henyey-Greenstein asymmetry
    box: Box | None  # where it is; null: everywhere


class Sensor(TypedDict, total=False):
    kind: Required[Literal["point", "line", "grid", "observer"]]  # where it measures; observer: glare
    quantity: Literal["plane", "cylindrical", "semicylindrical", "modelling", "ugr"]  # default plane; point, line, grid: which illuminance; or glare of eyes there
    position: Required[Sequence[float]]  # 3 m; -1e9 to 1e9; the point; the middle of a line or grid; the eye
    u: Sequence[float]  # 3 m; -1e9 to 1e9; default 1 0 0; line, grid: full edge
    v: Sequence[float]  # 3 m; -1e9 to 1e9; default 0 0 1; grid: full edge
    normal: Sequence[float]  # 3; -1e9 to 1e9; default 0 1 0; see PROTOCOL.md
    direction: Sequence[float]  # 3; -1e9 to 1e9; default 0 0 -1; line of sight of an observer, and the first of eyes (ugr); where a half cylinder faces
    directions: int  # 1 to 64; default 8; point, line, grid: ugr: lines of sight of each eye, evenly around the vertical
    spacing_m: float | None  # m; 1e-06 to 1e9; line, grid: between points, at most; null: by EN 12464-1
    floor_m2: float | None  # m2; 1e-06 to 1e+18; grid: of the room, over which power is told; null: the grid's own area
    target_lx: float | None  # lx; 1e-06 to 1e9; point, line, grid: mean that is wanted, at least
    target_uo: float | None  # 1e-06 to 1; line, grid: least over mean, at least
    target_ugr: float | None  # 1e-06 to 100; point, line, grid, observer: at most; else with quantity ugr alone
    target_dgp: float | None  # 1e-06 to 1; observer: at most
    name: str | None  # for people


class Patch(TypedDict, total=False):
    protocol: Literal["sacn", "artnet"]  # default sacn
    universe: int  # 0 to 63999; default 1; sacn: 1 to 63999; artnet: the port address, 0 to 32767
    address: int  # 1 to 512; default 1; of its first channel
    channels: Literal["dim", "dim16", "rgb", "rgb16"]  # default dim; from there on; 16: two a value, the coarse one first
    curve: Literal["linear", "square", "dali"]  # default linear; see PROTOCOL.md
    target: Required[str]  # a light, an object or a mixing group, there when it is set


class Preset(TypedDict, total=False):
    name: str | None  # for people
    order: float  # -1e6 to 1e6; default 0; where it stands among the others: less comes first, then by id
    fade_s: float  # s; 0 to 3600; default 0; that a recall takes which says nothing else; 0: at once
    lamps: Sequence[Lamps] | None  # that it changes; all others stay as they are


class Camera(TypedDict, total=False):
    position: Required[Sequence[float]]  # 3 m; -1e9 to 1e9
    target: Required[Sequence[float]]  # 3 m; -1e9 to 1e9; looked at
    up: Sequence[float]  # 3; -1e9 to 1e9; default 0 1 0; not parallel to the view direction
    vfov_deg: float  # deg; 1 to 179; default 45; vertical field of view, of a perspective
    projection: Literal["perspective", "panorama"]  # default perspective; panorama: all around, up at the upper edge


class Render(TypedDict, total=False):
    method: str  # default live; default of views; see lumend methods
    spp: int  # 0 to 65536; default 1024; samples per pixel at which a resting picture stops; 0: never
    max_depth: int  # 0 to 64; default 64; path segments after the first hit; roulette ends nearly all before
    shadow_samples: int  # 1 to 16; default 16; per area light and pixel in deferred methods: 1, 4, 9 or 16
    seed: int  # 0 to 4294967295; default 0
    vpls: int  # 1 to 65536; default 256; see PROTOCOL.md
    cache_accuracy: float  # 0.01 to 1; default 0.2; error that records of a cache may have: less is finer and slower
    antialias: bool  # default true; smooth edges of surfaces and, in live, of hard shadows; false: rays through pixel centres
    exposure_ev: float | None  # EV100; -30 to 30; higher is darker; null: automatic
    tone_map: Literal["agx", "aces", "reinhard", "none"]  # default agx
    glass: Literal["physical", "architectural"]  # default physical; see PROTOCOL.md
    camera: str | None  # of views that name none, there when it is set; null, or gone: main, else the first by id


class Import(TypedDict, total=False):
    asset: Required[str]  # model file below the asset root
    transform: Transform | Sequence[float]  # default identity; model to world; must be invertible


class AddRecords:
    """Of Edit: what each type of record is made of is known to editors and checkers."""

    def add(self, type: str, id: str, **fields) -> None:
        raise NotImplementedError

    def add_mesh(self, id: str, **fields: Unpack[Mesh]) -> None:
        self.add("mesh", id, **fields)

    def add_image(self, id: str, **fields: Unpack[Image]) -> None:
        self.add("image", id, **fields)

    def add_material(self, id: str, **fields: Unpack[Material]) -> None:
        self.add("material", id, **fields)

    def add_object(self, id: str, **fields: Unpack[Object]) -> None:
        self.add("object", id, **fields)

    def add_light(self, id: str, **fields: Unpack[Light]) -> None:
        self.add("light", id, **fields)

    def add_medium(self, id: str, **fields: Unpack[Medium]) -> None:
        self.add("medium", id, **fields)

    def add_sensor(self, id: str, **fields: Unpack[Sensor]) -> None:
        self.add("sensor", id, **fields)

    def add_patch(self, id: str, **fields: Unpack[Patch]) -> None:
        self.add("patch", id, **fields)

    def add_preset(self, id: str, **fields: Unpack[Preset]) -> None:
        self.add("preset", id, **fields)

    def add_camera(self, id: str, **fields: Unpack[Camera]) -> None:
        self.add("camera", id, **fields)
