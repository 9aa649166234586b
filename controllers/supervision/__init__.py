"""
Supervision (ATS): who is held at a platform, and when trains are to arrive.

They promise:

- a train is held for a stated time at most, so that no line comes to a stand for good;
- the same state, authority and memory give the same orders;
- they name the time at which they want to be asked again, which lies ahead.

They rely on the timetable, minimum dwells and the trains' own abilities; how long a train will
really overstay they do not know. Orders end no stop early, and move no end of authority.
"""
