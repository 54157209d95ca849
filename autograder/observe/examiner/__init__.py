"""The examiner's own ends: nodes that add little, servers and clients, listeners, a radio link."""
