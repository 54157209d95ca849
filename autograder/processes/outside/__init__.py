"""What an examiner needs from this machine besides DDS, and cannot reach from its sandbox.

The processes of a submission are looked at (their threads, files, memory, processor time), and its
network is made to lose packets. For a sandboxed submission a *warden* does so: a small process
outside of all sandboxes, one a submission, which answers its examiner's requests and nobody else's.
An examiner that the submission has taken can at worst have it tell about that submission. In a
student's own kernel the same requests are answered in the examiner's process.
"""
