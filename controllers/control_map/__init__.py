"""
Control map: a centre plans the bands of all trains, and trains keep within theirs.

It promises:

- bands do not overlap; a map whose bands do is not sent;
- no command lets a train go beyond what was free when it was made;
- a train that may have left its band brakes in emergency.

It relies on reports no older than it allows for; what it believes of units that may be wrong is
said in :mod:`kankaku.controllers.control_map.measuring`.
"""
