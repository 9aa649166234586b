"""
Vocabulary and physics of a railway line.

Everything here is SI and knows numpy and scipy only. The other rooms (scenarios,
sumo_net, controllers, analysis) import this one; it imports none of them.
"""
