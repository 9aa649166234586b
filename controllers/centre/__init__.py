"""What a centre knows by reports, and what trains do with limits that come by radio."""
