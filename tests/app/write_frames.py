"""Writes the frames of a folder of OFF files once more, as NumPy and VTK themselves write them: IN OUT."""
import pathlib
import sys

import numpy
import vtkmodules.vtkCommonCore as core
import vtkmodules.vtkCommonDataModel as model
import vtkmodules.vtkIOLegacy as legacy
import vtkmodules.vtkIOXML as xml

source, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
frames = []
for file in sorted(source.glob("*.off")):
    words = file.read_text().split()
    vertices, triangles = int(words[1]), int(words[2])
    numbers = numpy.array(words[4:], float)
    frames.append(numbers[: 3 * vertices].reshape(-1, 3))
    faces = numbers[3 * vertices :].reshape(triangles, 4)[:, 1:].astype(int)

out.mkdir()
numpy.savez(out / "plain.npz", positions=numpy.array(frames), faces=faces)
numpy.savez_compressed(out / "packed.npz", positions=numpy.array(frames, ">f8"), faces=faces.astype(numpy.uint8))


def polydata(points):
    data = model.vtkPolyData()
    places = core.vtkPoints()
    places.SetDataTypeToDouble()
    for point in points:
        places.InsertNextPoint(point)
    data.SetPoints(places)
    cells = model.vtkCellArray()
    for face in faces:
        cells.InsertNextCell(3, [int(corner) for corner in face])
    data.SetPolys(cells)
    for name, target in (("at points", data.GetPointData()), ("TimeValue", data.GetFieldData())):
        array = core.vtkDoubleArray()
        array.SetName(name)
        array.SetNumberOfTuples(len(points))
        array.Fill(1.5)
        target.AddArray(array)
    return data


def write(name, ending, writer, settings):
    folder = out / name
    folder.mkdir()
    for number, points in enumerate(frames):
        one = writer()
        one.SetInputData(polydata(points))
        one.SetFileName(str(folder / f"f{number}.{ending}"))
        settings(one)
        one.Write()


for version in (42, 51):
    for kind in ("ASCII", "Binary"):
        def legacy_settings(one, version=version, kind=kind):
            one.SetFileVersion(version)
            getattr(one, "SetFileTypeTo" + kind)()

        write(f"legacy_{version}_{kind}", "vtk", legacy.vtkPolyDataWriter, legacy_settings)

for mode in ("Ascii", "Binary", "Appended"):
    for encoded in (False, True):
        for compressor in ("None", "ZLib"):
            def xml_settings(one, mode=mode, encoded=encoded, compressor=compressor):
                getattr(one, "SetDataModeTo" + mode)()
                one.SetEncodeAppendedData(encoded)
                getattr(one, "SetCompressorTypeTo" + compressor)()
                one.SetHeaderTypeToUInt64() if encoded else one.SetHeaderTypeToUInt32()
                one.SetByteOrderToBigEndian() if compressor == "None" else one.SetByteOrderToLittleEndian()
                one.SetBlockSize(240)

            write(f"xml_{mode}_{encoded}_{compressor}", "vtp", xml.vtkXMLPolyDataWriter, xml_settings)
