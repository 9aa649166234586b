"""
Energy: how a train spends time that is worth less than the energy it saves.

A layer around any operation. It promises:

- it only lowers what the operation advises, and says where in a word of its own;
- on a leg that it gives no time to spare, no train arrives later than without it by more than the
  margin, whatever holds the train up.

It relies on the line and the driving style as the protection's foresight has them, and plans a leg
when a train departs; delays to come it does not know.
"""
