"""Networks that make depth of a photograph: .onnx files, and functions that the caller gives."""
