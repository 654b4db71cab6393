"""Documents from elsewhere."""

CART = '<body><joint name="s" type="slide" axis="1 0 0"/><geom size="0.1"/>{}</body>'


POLE = '<body><joint name="h" axis="0 1 0"/><geom pos="0 0 1" size="0.1"/>{}</body>'


MOTOR = '<motor name="m" joint="s"/>'


def document(world: str = CART.format(POLE.format("")), motor: str = MOTOR, more: str = "") -> str:
    return (
        f'<mujoco><option timestep="0.02"/>{more}<worldbody>{world}</worldbody>'
        f"<actuator>{motor}</actuator></mujoco>"
    )
