"""
Protections: how far and how fast a train may go.

They promise:

- a train that keeps its end of authority with the service brake runs into nothing;
- what is permitted once is taken back only for what comes suddenly;
- what :class:`~kankaku.railway.step.control.Foresight` says is what they permit.

They rely on the wayside for who is where and what is granted, and remember only what they return.
"""
