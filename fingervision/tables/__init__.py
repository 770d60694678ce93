"""Any lab's table in: dialect, columns and units of a foreign table, and from them a measured table, drive or model."""
