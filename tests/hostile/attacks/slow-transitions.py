# title: Transitions of a managed node that each come just in time
# exercise: resources
# base: right-exemplar
# score: any

import time


def late(transition):
    def carry_out(self, state):
        time.sleep(7)
        return transition(self, state)

    return carry_out


for name in ("on_configure", "on_activate", "on_deactivate", "on_cleanup", "on_shutdown"):
    if name in vars(ManagedCamera):
        setattr(ManagedCamera, name, late(vars(ManagedCamera)[name]))
