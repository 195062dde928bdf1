#!/usr/bin/env python3
"""Writes the seeds and dictionaries of the fuzz targets: make_corpus.py PROJECT OUTPUT [DATA].

OUTPUT/seeds/TARGET holds small inputs made from the project's scenes, studies and hard cases and, where the folder DATA
is there, from its meshes, pairs and response cases, cut to a few dozen triangles; nothing of them is committed.
OUTPUT/dictionaries/TARGET has the words that stand in quotes in the target's own sources, so that it knows every key.
"""
import base64
import gzip
import io
import itertools
import json
import pathlib
import re
import shutil
import struct
import sys
import zipfile

MOST_FACES = 24
SOURCES = {
    'mesh_obj': ['geometry/mesh_obj.cpp', 'geometry/mesh_text.cpp'],
    'mesh_off': ['geometry/mesh_off.cpp', 'geometry/mesh_text.cpp'],
    'mesh_ply': ['geometry/mesh_ply.cpp', 'geometry/mesh_text.cpp'],
    'mesh_stl': ['geometry/mesh_stl.cpp', 'geometry/mesh_text.cpp'],
    'mesh_vrml': ['geometry/mesh_vrml.cpp', 'geometry/mesh_text.cpp'],
    'mesh_vtk': ['geometry/mesh_vtk.cpp', 'geometry/mesh_text.cpp'],
    'mesh_vtp': ['geometry/mesh_vtk.cpp', 'geometry/mesh_text.cpp'],
    'frames': ['geometry/npz_file.cpp', 'playback/frame_series.cpp'],
    'scene': ['scene/*.cpp', 'scene/*.hpp'],
    'run': ['scene/*.cpp', 'scene/*.hpp', 'respond/*settings.cpp', 'method/*.cpp'],
    'study': ['study/study*.cpp', 'method/*.cpp', 'simulate/overrides.cpp', 'simulate/hard_case.cpp'],
    'recording': ['scene/recording.cpp'],
    'replay': ['scene/recording.cpp'],
    'baseline': ['study/contact_baseline.cpp'],
    'lines': ['geometry/gzip.cpp'],
    'record': ['measure/record.cpp', 'measure/record.hpp', 'contact/outcome.cpp'],
    'report': ['measure/record.cpp', 'measure/record.hpp', 'measure/metrics.*', 'contact/outcome.cpp', 'report/worst_tick*.cpp'],
    'response_cases': ['app/command_respond.cpp', 'app/respond_*.cpp', 'app/respond_*.hpp'],
    'shard': ['study/shard.cpp'],
    'external_data': ['scene/fcl_scenario.cpp', 'scene/ccd_queries.cpp'],
    'pairs': ['geometry/pair_file.cpp', 'geometry/exact.cpp'],
}


def words_of(project, patterns):
    """What stands in quotes, keys of JSON with their own."""
    words = {'1e308', '-1e308', '1e-320', '2147483648', '-1', '4294967295', '9223372036854775807', '1e999', 'nan', 'inf'}
    for pattern in patterns:
        for file in sorted((project / 'src').glob(pattern)):
            text = re.sub(r'#include.*', '', file.read_text())
            words.update(re.findall(r'"([A-Za-z0-9_.:#-]{1,30})"', text))
    return sorted(words)


def faces_of_polygons(polygons):
    return [[p[0], p[i - 1], p[i]] for p in polygons for i in range(2, len(p))]


def read_obj(text):
    rows = [line.split() for line in text.splitlines()]
    vertices = [list(map(float, row[1:4])) for row in rows if row[:1] == ['v']]
    polygons = [[int(word.split('/')[0]) - 1 for word in row[1:]] for row in rows if row[:1] == ['f']]
    return vertices, faces_of_polygons(polygons)


def read_off(text):
    words = iter(word for line in text.splitlines() for word in line.split('#')[0].split())
    next(words)
    n, f, _ = (int(next(words)) for _ in range(3))
    vertices = [[float(next(words)) for _ in range(3)] for _ in range(n)]
    return vertices, faces_of_polygons([[int(next(words)) for _ in range(int(next(words)))] for _ in range(f)])


def read_stl(data):
    vertices = []
    for i in range(min(struct.unpack_from('<I', data, 80)[0], MOST_FACES)):
        numbers = struct.unpack_from('<12f', data, 84 + 50 * i)
        vertices += [numbers[3:6], numbers[6:9], numbers[9:12]]
    return vertices, [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(len(vertices) // 3)]


def read_vrml(text):
    points = re.search(r'point\s*\[([^\]]*)\]', text)
    indices = re.search(r'coordIndex\s*\[([^\]]*)\]', text)
    numbers = [float(word) for word in re.findall(r'[-+.\deE]+', points.group(1))]
    polygons = [[int(w) for w in part.split()] for part in re.sub(',', ' ', indices.group(1)).split('-1')]
    return [numbers[i:i + 3] for i in range(0, len(numbers) - 2, 3)], faces_of_polygons(p for p in polygons if p)


def cut(mesh):
    """The first faces and the vertices that they use."""
    vertices, faces = mesh
    faces = faces[:MOST_FACES]
    used = sorted({v for face in faces for v in face})
    new = {old: i for i, old in enumerate(used)}
    return [vertices[v] for v in used], [[new[v] for v in face] for face in faces]


def meshes_of(project, data):
    readers = {'.obj': lambda p: read_obj(p.read_text()), '.off': lambda p: read_off(p.read_text()),
               '.stl': lambda p: read_stl(p.read_bytes()), '.wrl': lambda p: read_vrml(p.read_text())}
    files = sorted((project / 'scenes/hard').glob('*/*.obj'))
    files += sorted(p for p in (data / 'meshes').rglob('*') if p.suffix.lower() in readers) if data else []
    found = {}
    for file in files:
        found[f'{file.parent.name}-{file.stem}'] = cut(readers[file.suffix.lower()](file))
    return found


def shown(numbers):
    return ' '.join(f'{x:.9g}' for x in numbers)


def obj_text(v, f, style):
    face = {0: lambda i: f'{i + 1}', 1: lambda i: f'{i + 1}/1/1', 2: lambda i: f'{i - len(v)}', 3: lambda i: f'{i + 1}//1'}[style]
    head = '# units: mm\nmtllib a.mtl\no part\nvt 0 0\nvn 0 0 1\n' if style else ''
    return head + ''.join(f'v {shown(p)}\n' for p in v) + ''.join('f ' + ' '.join(map(face, t)) + '\n' for t in f)


def off_text(v, f, style):
    head = ['OFF', 'COFF # colours', 'OFF BINARY'][style] if style < 2 else 'NOFF'
    extra = ['', ' 255 0 0 255', ' 0 0 1'][style]
    return f'{head}\n{len(v)} {len(f)} 0\n' + ''.join(f'{shown(p)}{extra}\n' for p in v) + ''.join(
        f'3 {a} {b} {c}\n' for a, b, c in f)


def stl_bytes(v, f, style):
    if style:
        facets = ''.join('facet normal 0 0 1\nouter loop\n' + ''.join(f'vertex {shown(v[i])}\n' for i in t) +
                         'endloop\nendfacet\n' for t in f)
        return f'solid part\n{facets}endsolid part\n'.encode()
    floats = [struct.pack('<3f', 0, 0, 1) + b''.join(struct.pack('<3f', *limited(v[i])) for i in t) + b'\0\0' for t in f]
    return b'part'.ljust(80) + struct.pack('<I', len(f)) + b''.join(floats)


def limited(point):
    return [max(-3e38, min(3e38, x)) for x in point]


def ply_bytes(v, f, style):
    form = ['ascii', 'binary_little_endian', 'binary_big_endian'][style]
    head = (f'ply\nformat {form} 1.0\ncomment units: mm\nelement vertex {len(v)}\nproperty double x\nproperty double y\n'
            f'property double z\nproperty uchar red\nelement face {len(f)}\nproperty list uchar int vertex_indices\n'
            'end_header\n').encode()
    if style == 0:
        return head + ''.join(f'{shown(p)} 7\n' for p in v).encode() + ''.join(f'3 {a} {b} {c}\n' for a, b, c in f).encode()
    end = '<' if style == 1 else '>'
    return head + b''.join(struct.pack(end + '3dB', *p, 7) for p in v) + b''.join(struct.pack(end + 'B3i', 3, *t) for t in f)


def vrml_text(v, f, style):
    shape = ('Shape { geometry IndexedFaceSet { solid FALSE coord DEF P Coordinate { point [' +
             ', '.join(map(shown, v)) + '] } coordIndex [' + ' '.join(f'{a} {b} {c} -1' for a, b, c in f) + '] } }')
    if style:
        shape = f'DEF T Transform {{ translation 1 2 3 rotation 0 0 1 0.5 scale 2 2 2 children [ {shape} ] }}\nUSE T\n'
        shape += 'Shape { geometry Sphere { radius 2 } }'
    return f'#VRML V2.0 utf8\n# units: mm\n{shape}\n'


def vtk_bytes(v, f, style):
    head = f'# vtk DataFile Version {"5.1" if style == 2 else "3.0"}\npart\n{"BINARY" if style == 1 else "ASCII"}\nDATASET POLYDATA\n'
    if style == 1:
        return (f'{head}POINTS {len(v)} double\n'.encode() + b''.join(struct.pack('>3d', *p) for p in v) +
                f'\nPOLYGONS {len(f)} {4 * len(f)}\n'.encode() + b''.join(struct.pack('>4i', 3, *t) for t in f))
    text = f'{head}POINTS {len(v)} float\n' + ''.join(f'{shown(p)}\n' for p in v)
    if style == 0:
        return text + f'POLYGONS {len(f)} {4 * len(f)}\n' + ''.join(f'3 {a} {b} {c}\n' for a, b, c in f)
    return (text + f'POLYGONS {len(f) + 1} {3 * len(f)}\nOFFSETS vtktypeint64\n' + shown(range(0, 3 * len(f) + 1, 3)) +
            '\nCONNECTIVITY vtktypeint64\n' + ' '.join(f'{a} {b} {c}' for a, b, c in f) + '\n')


def vtp_text(v, f, style):
    def array(name, kind, numbers, form, components=1):
        packed = struct.pack(f'<{len(numbers)}{form}', *numbers)
        content = shown(numbers) if style == 0 else base64.b64encode(struct.pack('<I', len(packed)) + packed).decode()
        return (f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
                f'format="{"binary" if style else "ascii"}">{content}</DataArray>\n')
    return ('<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">\n<PolyData>\n'
            f'<Piece NumberOfPoints="{len(v)}" NumberOfPolys="{len(f)}">\n<Points>\n' +
            array('Points', 'Float64', [x for p in v for x in p], 'd', 3) + '</Points>\n<Polys>\n' +
            array('connectivity', 'Int32', [i for t in f for i in t], 'i') +
            array('offsets', 'Int32', [3 * i + 3 for i in range(len(f))], 'i') +
            '</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n')


def npz_bytes(v, f, packed):
    def npy(kind, shape, data):
        head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
        head += b' ' * (-(len(head) + 11) % 64) + b'\n'
        return b'\x93NUMPY\x01\0' + struct.pack('<H', len(head)) + head + data
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED) as archive:
        positions = b''.join(struct.pack('<3d', *p) for p in v)
        archive.writestr(zipfile.ZipInfo('positions.npy'), npy('<f8', (2, len(v), 3), 2 * positions))
        archive.writestr(zipfile.ZipInfo('faces.npy'), npy('<i4', (len(f), 3), b''.join(struct.pack('<3i', *t) for t in f)))
    return stream.getvalue()


def mesh_seeds(meshes):
    for name, (v, f) in meshes.items():
        for style in range(4):
            yield 'mesh_obj', f'{name}-{style}', obj_text(v, f, style)
        for style in range(3):
            yield 'mesh_off', f'{name}-{style}', off_text(v, f, style)
            yield 'mesh_ply', f'{name}-{style}', ply_bytes(v, f, style)
            yield 'mesh_vtk', f'{name}-{style}', vtk_bytes(v, f, style)
        for style in range(2):
            yield 'mesh_stl', f'{name}-{style}', stl_bytes(v, f, style)
            yield 'mesh_vrml', f'{name}-{style}', vrml_text(v, f, style)
            yield 'mesh_vtp', f'{name}-{style}', vtp_text(v, f, style)
            yield 'frames', f'{name}-{style}', npz_bytes(v, f, style)


def raw_seeds(data):
    """The beginnings of the files as they are: headers and comments of other programs."""
    for file in sorted((data / 'meshes').rglob('*')):
        kind = {'.wrl': 'vrml'}.get(file.suffix.lower(), file.suffix.lower()[1:])
        if f'mesh_{kind}' in SOURCES:
            yield f'mesh_{kind}', f'head-{file.stem}', file.read_bytes()[:3000]


def coarse(scene):
    """The same scene with few triangles and everything that moves within the first ticks."""
    for body in scene['bodies']:
        for part in body.get('parts', []):
            if 'edge' in part:
                sizes = [x for x in json.dumps(part).replace(',', ' ').replace('[', ' ').replace(']', ' ').split()]
                numbers = [abs(float(x.rstrip('}'))) for x in sizes if re.fullmatch(r'-?[\d.e-]+}?', x)]
                part['edge'] = max(part['edge'], max(numbers) / 6)
        for key in body.get('motion', {}).get('keys', []):
            key['time'] = key['time'] / 50
    scene['ticks'] = 20
    scene.pop('description', None)
    return scene


def method_names(project, kind):
    text = '\n'.join(p.read_text() for p in sorted((project / 'src').glob('*/CMakeLists.txt')))
    return re.findall(rf'trocar_add_{kind}\((\w+)\)', text)


def scene_seeds(project):
    responses = method_names(project, 'response') + ['thesis:profile=corrected', 'thesis:profile=printed']
    detectors = itertools.cycle(['-', 'ohc', 'brute_force', 'ohc_clustered:swept=on'])
    contacts = itertools.cycle(['-'] * 3 + method_names(project, 'source'))
    steppers = itertools.cycle(['-'] * 2 + method_names(project, 'stepper'))
    for file in sorted((project / 'scenes').glob('*.json')):
        scene = coarse(json.loads(file.read_text()))
        if any('mesh' in part for body in scene['bodies'] for part in body.get('parts', [])):
            for body in scene['bodies']:
                for part in body['parts']:
                    if 'mesh' in part:
                        part.update(mesh='box.obj' if body.get('closed', True) else 'sheet.obj', scale=0.01)
        text = json.dumps(scene)
        yield 'scene', file.stem, text
        for response in responses:
            methods = f'{next(detectors)} {response} {next(contacts)} {next(steppers)}'
            yield 'run', f'{file.stem}-{re.sub("[^a-z_]", "-", response)}', methods + '\n' + text


def recordings(meshes):
    """Two bodies, the second moving through the first."""
    names = list(meshes)
    for one, two in zip(names, names[1:]):
        (v1, f1), (v2, f2) = meshes[one], meshes[two]
        n, t = len(v1) + len(v2), len(f1) + len(f2)
        if n == 0 or n > 60:
            continue
        frames = 3
        header = {'format': 'trocar-recording-1', 'unit': 'm', 'dt': 0.001, 'frames': frames, 'vertices': n, 'triangles': t,
                  'bodies': [{'name': 'tool', 'kind': 'instrument', 'closed': False, 'instrument': 'arm',
                              'vertices': [0, len(v1)], 'triangles': [0, len(f1)]},
                             {'name': 'sheet', 'kind': 'tissue', 'closed': False,
                              'vertices': [len(v1), len(v2)], 'triangles': [len(f1), len(f2)]}],
                  'body_pairs': [[0, 1]]}
        text = json.dumps(header).encode()
        text += b' ' * (-len(text) % 8)
        triangles = b''.join(struct.pack('<3I', *f) for f in f1) + b''.join(
            struct.pack('<3I', *(i + len(v1) for i in f)) for f in f2)
        triangles += b'\0' * (-len(triangles) % 8)
        size = max((abs(x) for p in v1 for x in p), default=1.0)
        positions = b''
        for frame in range(frames):
            step = size * (frame - 1) / 4
            positions += b''.join(struct.pack('<3d', *p) for p in v1)
            positions += b''.join(struct.pack('<3d', p[0], p[1], p[2] + step) for p in v2)
        yield f'{one}-{two}', b'TROCREC1' + struct.pack('<Q', len(text)) + text + triangles + positions


def baseline_text(contacts):
    document = {'format': 'trocar-baseline-1', 'source': 'i2t_poke', 'source_hash': '0123456789abcdef',
                'frames_hash': 'fedcba9876543210', 'ticks': 40, 'every': 20,
                'detectors': {'ohc': {'outcome': 'ok', 'contacts': 0}, 'brute_force': {'outcome': 'truncated', 'contacts': 1}},
                'contacts': [{'0': contacts}, {'0': contacts[:1], '20': contacts[1:]}]}
    return json.dumps(document)


def record_seeds(project):
    """Published records of every kind of run, cut to the first few of what they list."""
    kinds = {}
    for file in sorted((project / 'reports').glob('*/records.jsonl.gz')):
        for line in gzip.open(file, 'rt').read().splitlines():
            record = json.loads(line)
            kinds.setdefault((record['spec']['mode'], record['outcome'], 'events' in record), record)
    for (mode, outcome, events), record in kinds.items():
        for count in (0, 2):
            few = dict(record, environment=dict(list(record['environment'].items())[:count]),
                       summary=dict(list(record['summary'].items())[:4 * count]))
            few['rows'] = {key: column[:count] if isinstance(column, list) else column
                           for key, column in record['rows'].items()} if isinstance(record['rows'], dict) else {}
            if events:
                few['events'] = {key: column[:count] for key, column in record['events'].items()}
            yield 'record', f'{mode}-{outcome}-{events}-{count}', json.dumps(few)
        few['summary'] = record['summary']  # what charts and tables are made of
        yield 'report', f'{mode}-{outcome}-{events}', json.dumps(few)


def seeds(project, data):
    meshes = meshes_of(project, data)
    yield from mesh_seeds(meshes)
    yield from scene_seeds(project)
    for file in sorted((project / 'bench/studies').glob('*.json')):
        yield 'study', file.stem, file.read_text()
    for name, recording in recordings(meshes):
        yield 'recording', name, recording
        yield 'replay', name, recording
    kinds = ['a_enters_b', 'b_enters_a', 'edges_cross', 'touch', 'coplanar', 'degenerate', 'unset']
    contacts = [[i, i + 7, kind, 0.01 * i, 0, -0.002, 0, 0, 1, 0.001] for i, kind in enumerate(kinds)]
    contacts.append([3, 4, 'touch'] + [None] * 7)
    yield 'baseline', 'all', baseline_text(contacts)
    yield 'baseline', 'few', baseline_text(contacts[:2])
    yield from record_seeds(project)
    one = json.loads(gzip.open(project / 'reports/default/records.jsonl.gz', 'rt').readline())
    yield 'lines', 'one', gzip.compress(b'one\ntwo\n', mtime=0)
    yield 'lines', 'two', gzip.compress(bytes(5000) + b'\n', mtime=1) + gzip.compress(b'', 1, mtime=0)
    for file in sorted((project / 'reports').glob('*/worst_tick.json')):
        yield 'report', f'worst-{file.parent.name}', json.dumps(json.loads(file.read_text())) + '\n' + json.dumps(dict(one, rows={}))
    whole = {'format': 'trocar-shard-1', 'study': 's', 'study_file': 's.json', 'study_digest': '0123456789abcdef', 'time_limit_s': 60.0,
             'binary': 'fedcba9876543210', 'shards': 2, 'shard': 1,
             'runs': [{'key': f'000000000000000{i}', 'shard': 1 + i % 2, 'name': f'run {i}'} for i in range(3)]}
    yield 'shard', 'whole', json.dumps(whole)
    yield 'shard', 'none', json.dumps(dict(whole, runs=[]))
    yield 'pairs', 'two', '0 0 0 1 0 0 0 1 0 0.2 0.2 -1 0.2 0.2 1 0.3 0.4 1 1 transversal\n0 0 0 1 0 0 0 1 0 5 5 5 6 5 5 5 6 5\n'
    yield 'external_data', 'scenario', ('<OBJECT id="1"><GRID id="1" x="0" y="0" z="0"/><TRIA id="1" g1="1" g2="1" g3="1"/></OBJECT>\n' * 2
        + '<FRAME id="1" obj1_pos="0 0 0" obj2_pos="1 2 3" obj1_dc="1 0 0 0 1 0 0 0 1" obj2_dc="1 0 0 0 1 0 0 0 1"/>\n')
    yield 'external_data', 'query', '0,1,1,2,-3,4,1\n' * 8
    yield 'response_cases', 'none', '{"format": "response-cases-1", "cases": []}'
    if data:
        yield from raw_seeds(data)
        for file in sorted((data / 'tritri').glob('*.txt')):
            lines = file.read_text().splitlines()
            for i in range(0, min(len(lines), 40), 8):
                yield 'pairs', f'{file.stem}-{i}', '\n'.join(lines[i:i + 2]) + '\n'
        cases = json.loads((data / 'response/response_cases.json').read_text())
        for case in cases['cases']:
            yield 'response_cases', case['id'], json.dumps({'format': cases['format'], 'cases': [case]})


def main():
    project, output = map(pathlib.Path, sys.argv[1:3])
    data = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None
    for folder in ('seeds', 'dictionaries'):
        shutil.rmtree(output / folder, ignore_errors=True)
        (output / folder).mkdir(parents=True)
    for target, patterns in SOURCES.items():
        (output / 'seeds' / target).mkdir()
        words = words_of(project, patterns)
        (output / 'dictionaries' / target).write_text(''.join(f'"{word}"\n' for word in words))
    for target, name, content in seeds(project, data):
        content = content.encode() if isinstance(content, str) else content
        (output / 'seeds' / target / name).write_bytes(content)
    for target in SOURCES:
        count = len(list((output / 'seeds' / target).iterdir()))
        print(f'{target}: {count} seeds')


main()
