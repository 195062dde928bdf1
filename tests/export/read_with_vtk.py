"""Reads .vtp files with VTK's own reader and prints what it got as JSON: {file: {points, polys, verts, arrays, field}}."""
import json
import sys

from vtkmodules.vtkIOXML import vtkXMLPolyDataReader


def values(array):
    if not hasattr(array, "GetComponent"):
        return [array.GetValue(i) for i in range(array.GetNumberOfValues())]
    return [array.GetComponent(i, c) for i in range(array.GetNumberOfTuples()) for c in range(array.GetNumberOfComponents())]


def arrays(data):
    found = {}
    for i in range(data.GetNumberOfArrays()):
        array = data.GetAbstractArray(i)
        found[array.GetName()] = values(array)
    return found


def read(file):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(file)
    reader.Update()
    if reader.GetErrorCode() != 0:
        sys.exit(f"{file}: VTK's reader ends with error {reader.GetErrorCode()}")
    data = reader.GetOutput()
    points = [x for i in range(data.GetNumberOfPoints()) for x in data.GetPoint(i)]
    return {
        "points": points,
        "polys": [data.GetPolys().GetData().GetValue(i) for i in range(data.GetPolys().GetData().GetNumberOfValues())]
        if data.GetNumberOfPolys()
        else [],
        "verts": data.GetNumberOfVerts(),
        "arrays": arrays(data.GetPointData()),
        "cell_arrays": arrays(data.GetCellData()),
        "field": arrays(data.GetFieldData()),
    }


print(json.dumps({file: read(file) for file in sys.argv[1:]}))
